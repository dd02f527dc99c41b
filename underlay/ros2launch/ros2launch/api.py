"""Finding, describing and launching launch files."""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription, LaunchService
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import (
    AnyLaunchDescriptionSource,
    get_launch_description_from_any_launch_file,
)
from underlay_refusal import refuse

__all__ = [
    'MultipleLaunchFilesError',
    'get_share_file_path_from_package',
    'launch_a_launch_file',
    'parse_launch_arguments',
    'print_arguments_of_launch_description',
    'print_arguments_of_launch_file',
]
__getattr__ = refuse(__name__, __all__)


class MultipleLaunchFilesError(Exception):
    """A package has several files of that name."""


def get_share_file_path_from_package(*, package_name: str, file_name: str) -> str:
    """Return the path of a file anywhere in the share directory of a package.

    Raises
    ------
    ament_index_python.packages.PackageNotFoundError
        When there is no such package.
    FileNotFoundError
        When the package has no such file.
    MultipleLaunchFilesError
        When it has several.

    """
    share = get_package_share_directory(package_name)
    paths = [str(p) for p in sorted(Path(share).rglob('*')) if p.name == file_name and p.is_file()]
    if not paths:
        raise FileNotFoundError(
            f"file '{file_name}' was not found in the share directory of package "
            f"'{package_name}' which is at '{share}'"
        )
    if len(paths) > 1:
        found = ', '.join(f"'{path}'" for path in paths)
        raise MultipleLaunchFilesError(
            f"file '{file_name}' was found more than once in the share directory of package "
            f"'{package_name}': [{found}]"
        )
    return paths[0]


def print_arguments_of_launch_file(*, launch_file_path: str) -> None:
    """Print the launch arguments of a launch file."""
    print_arguments_of_launch_description(
        launch_description=get_launch_description_from_any_launch_file(launch_file_path)
    )


def print_arguments_of_launch_description(*, launch_description: LaunchDescription) -> None:
    """Print the launch arguments that a launch description declares."""
    print("Arguments (pass arguments as '<name>:=<value>'):")
    arguments = launch_description.get_launch_arguments()
    for argument in arguments:
        print(_describe(argument))
    if not arguments:
        print('\n  No arguments.')
    if any(argument._conditionally_included for argument in arguments):
        print('\n* argument(s) which are only used if specific conditions occur')


def _describe(argument: DeclareLaunchArgument) -> str:
    mark = '*' if argument._conditionally_included else ''
    text = f"\n    '{argument.name}':{mark}\n        {argument.description}"
    if argument.default_value is None:
        return text
    default = ' + '.join(sub.describe() for sub in argument.default_value)
    return f'{text}\n        (default: {default})'


def parse_launch_arguments(launch_arguments: list[str]) -> list[tuple[str, str]]:
    """Split arguments of the form name:=value; the last one of a name holds.

    Raises
    ------
    RuntimeError
        When an argument has no name or no value.

    """
    parsed: dict[str, str] = {}
    for argument in launch_arguments:
        name, _, value = argument.partition(':=')
        if not name or not value:
            raise RuntimeError(
                f"malformed launch argument '{argument}', expected format '<name>:=<value>'"
            )
        parsed[name] = value
    return list(parsed.items())


def launch_a_launch_file(
    *,
    launch_file_path: str,
    launch_file_arguments: list[str],
    noninteractive: bool = False,
    debug: bool = False,
) -> int:
    """Launch a launch file, and return 0, or 1 when there was an error."""
    service = LaunchService(argv=launch_file_arguments, noninteractive=noninteractive, debug=debug)
    inclusion = IncludeLaunchDescription(
        AnyLaunchDescriptionSource(launch_file_path),
        launch_arguments=parse_launch_arguments(launch_file_arguments),
    )
    service.include_launch_description(LaunchDescription([inclusion]))
    return service.run()
