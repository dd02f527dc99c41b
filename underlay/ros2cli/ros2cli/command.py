"""What a command of ros2 is."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace


class CommandExtension:
    """A command, known by an entry point of the group ros2cli.command.

    Its first line of documentation is its description in the help.
    """

    def add_arguments(self, parser: ArgumentParser, cli_name: str) -> None:
        """Declare the command's arguments; cli_name is how it is called."""

    def main(self, *, parser: ArgumentParser, args: Namespace) -> int | str | None:
        """Do what the command is for, and return the exit status or what went wrong."""
        raise NotImplementedError(type(self).__name__)
