"""ros2 launch."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
import sys

from ament_index_python.packages import get_package_share_directory, PackageNotFoundError
from launch import LaunchDescription, LaunchService
from launch.actions import OpaqueFunction

from .launch_file import load, print_arguments


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
        parser.add_argument('package_name', help='Name of the package which has the launch file')
        parser.add_argument('launch_file_name', help='Name of the launch file')
        parser.add_argument(
            'launch_arguments',
            nargs='*',
            help="Arguments to the launch file; '<name>:=<value>' (for duplicates, last one wins)",
        )

    def main(self, args: Namespace) -> int | None:
        """Launch the file, or print its arguments."""
        path = _find(args.package_name, args.launch_file_name)
        if args.show_args:
            return print_arguments(load(path))
        # With a terminal, its Ctrl-C reaches the processes too.
        service = LaunchService(noninteractive=not sys.stdin.isatty(), debug=args.debug)
        service.context.launch_configurations.update(_parse(args.launch_arguments))
        # Loaded in the run, so that an error in the file ends the launch with a log line.
        inclusion = OpaqueFunction(function=lambda context: [load(path)])
        service.include_launch_description(LaunchDescription([inclusion]))
        return service.run()


def _find(package: str, name: str) -> str:
    """Return the path of a launch file; RuntimeError if there is none."""
    try:
        share = get_package_share_directory(package)
    except (PackageNotFoundError, ValueError) as error:
        raise RuntimeError(f"Package '{package}' not found: {error}") from error
    paths = [str(path) for path in sorted(Path(share).rglob('*')) if path.name == name]
    if not paths:
        raise RuntimeError(
            f"file '{name}' was not found in the share directory of package '{package}' which is "
            f"at '{share}'"
        )
    return paths[0]


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
