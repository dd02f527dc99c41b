"""The names on a command line of what can be measured or drawn."""

import argparse
from collections.abc import Collection


def parsed(parser: argparse.ArgumentParser, offered: Collection[str]) -> argparse.Namespace:
    """Return a command line whose `names` are by default all; end if one is unknown."""
    parser.add_argument('names', nargs='*', metavar='NAME', help=', '.join(offered))
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.names) - set(offered))
    if unknown:
        parser.error(f'unknown: {", ".join(unknown)}; there are {", ".join(offered)}')
    arguments.names = arguments.names or list(offered)
    return arguments
