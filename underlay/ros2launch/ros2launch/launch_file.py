"""Launch files in Python."""

from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader

from launch import LaunchDescription


def load(path: str) -> LaunchDescription:
    """Return what the launch file's generate_launch_description() returns."""
    loader = SourceFileLoader('python_launch_file', path)
    module = module_from_spec(spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module.generate_launch_description()


def print_arguments(description: LaunchDescription) -> None:
    """Print the launch arguments that a launch description declares."""
    print("Arguments (pass arguments as '<name>:=<value>'):")
    for argument in description.get_launch_arguments():
        print(f"\n    '{argument.name}':\n        {argument.description}")
        print(f"        (default: '{argument.default_value}')")
