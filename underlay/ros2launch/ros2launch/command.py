"""ros2 launch."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
import os
from pathlib import Path
import sys

from ament_index_python.packages import get_package_share_directory, PackageNotFoundError
from launch import LaunchDescription, LaunchService

from .launch_file import IncludeLaunchFile, load, print_arguments


class LaunchCommand:
    """Run a launch file."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Declare the command's arguments."""
        parser.add_argument(
            '-d', '--debug', action='store_true', help='Log in detail, with tracebacks of errors.'
        )
        parser.add_argument(
            '-s',
            '--show-args',
            '--show-arguments',
            action='store_true',
            help='Show arguments that may be given to the launch file.',
        )
        parser.add_argument(
            'package_name', help='Name of the package which has the launch file, or its path'
        )
        parser.add_argument('launch_file_name', nargs='?', help='Name of the launch file')
        parser.add_argument(
            'launch_arguments',
            nargs='*',
            help="Arguments to the launch file; '<name>:=<value>' (for duplicates, last one wins)",
        )

    def main(self, args: Namespace) -> int | None:
        """Launch the file, or print its arguments."""
        path, words = _find(args)
        if args.show_args:
            return print_arguments(load(path))
        # With a terminal, its Ctrl-C reaches the processes too.
        service = LaunchService(noninteractive=not sys.stdin.isatty(), debug=args.debug)
        inclusion = IncludeLaunchFile(path, _parse(words))
        service.include_launch_description(LaunchDescription([inclusion]))
        return service.run()


def _find(args: Namespace) -> tuple[str, list[str]]:
    """Return the path of the launch file, and the arguments for it."""
    package, name = args.package_name, args.launch_file_name
    if os.path.isfile(package):
        return package, [*([] if name is None else [name]), *args.launch_arguments]
    try:
        share = get_package_share_directory(package)
    except (PackageNotFoundError, ValueError) as error:
        raise RuntimeError(f"Package '{package}' not found: {error}") from error
    paths = [str(path) for path in sorted(Path(share).rglob('*')) if path.name == name]
    where = f"in the share directory of package '{package}' which is at '{share}'"
    if not paths:
        raise RuntimeError(f"file '{name}' was not found {where}")
    if len(paths) > 1:
        raise RuntimeError(f"file '{name}' was found more than once {where}: {paths}")
    return paths[0], args.launch_arguments


def _parse(words: list[str]) -> dict[str, str]:
    """Return arguments of the form name:=value by name; RuntimeError for another form."""
    parsed = {}
    for word in words:
        name, _, value = word.partition(':=')
        if not name or not value:
            raise RuntimeError(
                f"malformed launch argument '{word}', expected format '<name>:=<value>'"
            )
        parsed[name] = value
    return parsed
