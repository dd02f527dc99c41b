"""ros2 launch."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
import os
import sys

from ament_index_python.packages import PackageNotFoundError
from ros2cli.command import CommandExtension

from .api import (
    get_share_file_path_from_package,
    launch_a_launch_file,
    MultipleLaunchFilesError,
    print_arguments_of_launch_file,
)


class LaunchCommand(CommandExtension):
    """Run a launch file."""

    def add_arguments(self, parser: ArgumentParser, cli_name: str) -> None:
        """Declare the command's arguments."""
        parser.add_argument(
            '-n',
            '--noninteractive',
            default=not sys.stdin.isatty(),
            action='store_true',
            help='Run the launch system non-interactively, with no terminal associated',
        )
        parser.add_argument(
            '-d',
            '--debug',
            action='store_true',
            help='Put the launch system in debug mode, provides more verbose output.',
        )
        parser.add_argument(
            '-s',
            '--show-args',
            '--show-arguments',
            action='store_true',
            help='Show arguments that may be given to the launch file.',
        )
        parser.add_argument(
            '-a',
            '--show-all-subprocesses-output',
            action='store_true',
            help="Show all launched subprocesses' output on the screen.",
        )
        parser.add_argument(
            'package_name', help='Name of the ROS package which contains the launch file'
        )
        parser.add_argument('launch_file_name', nargs='?', help='Name of the launch file')
        parser.add_argument(
            'launch_arguments',
            nargs='*',
            help="Arguments to the launch file; '<name>:=<value>' (for duplicates, last one wins)",
        )

    def main(self, *, parser: ArgumentParser, args: Namespace) -> int | None:
        """Launch the file, or print its arguments."""
        path, arguments = _find(args)
        if args.show_args:
            return print_arguments_of_launch_file(launch_file_path=path)
        if args.show_all_subprocesses_output:
            os.environ['OVERRIDE_LAUNCH_PROCESS_OUTPUT'] = 'both'
        return launch_a_launch_file(
            launch_file_path=path,
            launch_file_arguments=arguments,
            noninteractive=args.noninteractive,
            debug=args.debug,
        )


def _find(args: Namespace) -> tuple[str, list[str]]:
    """Return the path of the launch file, and the arguments for it."""
    if os.path.isfile(args.package_name):
        first = [] if args.launch_file_name is None else [args.launch_file_name]
        return args.package_name, first + args.launch_arguments
    try:
        path = get_share_file_path_from_package(
            package_name=args.package_name, file_name=args.launch_file_name
        )
    except PackageNotFoundError as error:
        raise RuntimeError(f"Package '{args.package_name}' not found: {error}") from error
    except ValueError as error:
        raise RuntimeError(
            f"'{args.package_name}' is neither a launch file nor the name of a package"
        ) from error
    except (FileNotFoundError, MultipleLaunchFilesError) as error:
        raise RuntimeError(str(error)) from error
    return path, args.launch_arguments
