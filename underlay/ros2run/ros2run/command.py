"""ros2 run."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace, REMAINDER
import shlex

from ament_index_python.packages import PackageNotFoundError
from ros2cli.command import CommandExtension

from .api import get_executable_path, MultipleExecutables, run_executable


class RunCommand(CommandExtension):
    """Run a package specific executable."""

    def add_arguments(self, parser: ArgumentParser, cli_name: str) -> None:
        """Declare the command's arguments."""
        parser.add_argument(
            '--prefix',
            help='Prefix command, which should go before the executable. '
            'Command must be wrapped in quotes if it contains spaces '
            "(e.g. --prefix 'gdb -ex run --args').",
        )
        parser.add_argument('package_name', help='Name of the ROS package')
        parser.add_argument('executable_name', help='Name of the executable')
        parser.add_argument(
            'argv', nargs=REMAINDER, help='Pass arbitrary arguments to the executable'
        )

    def main(self, *, parser: ArgumentParser, args: Namespace) -> int | str:
        """Run the executable, and return its exit status."""
        try:
            path = get_executable_path(
                package_name=args.package_name, executable_name=args.executable_name
            )
        except PackageNotFoundError as error:
            raise RuntimeError(f"Package '{args.package_name}' not found") from error
        except MultipleExecutables as error:
            found = ''.join(f'\n- {path}' for path in error.paths)
            raise RuntimeError(f'Multiple executables found:{found}') from error
        if path is None:
            return 'No executable found'
        prefix = None if args.prefix is None else shlex.split(args.prefix)
        return run_executable(path=path, argv=args.argv, prefix=prefix)
