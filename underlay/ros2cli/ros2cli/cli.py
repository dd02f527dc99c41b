"""The ros2 command, which calls the commands of other packages."""

from __future__ import annotations

from argparse import ArgumentParser
from importlib.metadata import entry_points
import os
import signal
import sys
from typing import Any

GROUP = 'ros2cli.command'


def load_commands() -> dict[str, Any]:
    """Return the commands that are installed, by name.

    A command has add_arguments(parser), main(args), which returns the exit status or an error
    message, and a docstring of one line for the help.
    """
    return {point.name: point.load()() for point in sorted(entry_points(group=GROUP))}


def make_parser(commands: dict[str, Any]) -> ArgumentParser:
    """Return a parser of all commands and their arguments."""
    parser = ArgumentParser(
        prog='ros2',
        description='ros2 is an extensible command-line tool for ROS 2. '
        f'Of its commands, the underlay covers: {", ".join(commands)}.',
    )
    subparsers = parser.add_subparsers(title='Commands', metavar='<command>')
    for name, command in commands.items():
        subparser = subparsers.add_parser(name, help=command.__doc__, description=command.__doc__)
        subparser.set_defaults(command=command)
        command.add_arguments(subparser)
    return parser


def main(argv: list[str] | None = None) -> int | str | None:
    """Run a command; return the exit status or an error message."""
    commands = load_commands()
    arguments = sys.argv[1:] if argv is None else argv
    if arguments and not arguments[0].startswith('-') and arguments[0] not in commands:
        return (
            f"'ros2 {arguments[0]}' is not covered by the underlay, which has: "
            f'{", ".join(commands)}. Source a ROS 2 installation for the whole command.'
        )
    parser = make_parser(commands)
    args = parser.parse_args(arguments)
    if not hasattr(args, 'command'):
        parser.print_help()
        return 0
    sys.stdout.reconfigure(line_buffering=True)
    try:
        return args.command.main(args)
    except KeyboardInterrupt:
        return signal.SIGINT
    except BrokenPipeError:
        # The reader of the output, such as head, is gone; Python would write the rest at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except RuntimeError as error:
        return str(error)
