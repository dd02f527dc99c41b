"""The names on a command line of what can be measured or drawn."""

import argparse
from collections.abc import Collection


def names_from_command_line(prog: str, description: str, offered: Collection[str]) -> list[str]:
    """Return the names that were given, by default all; end the program if one is unknown."""
    parser = argparse.ArgumentParser(prog=prog, description=description)
    parser.add_argument('names', nargs='*', metavar='NAME', help=', '.join(offered))
    names = parser.parse_args().names or list(offered)
    unknown = sorted(set(names) - set(offered))
    if unknown:
        parser.error(f'unknown: {", ".join(unknown)}; there are {", ".join(offered)}')
    return names
