"""Names of measurements or figures on a command line."""

import argparse
from collections.abc import Collection


def parsed(parser: argparse.ArgumentParser, offered: Collection[str]) -> argparse.Namespace:
    """Return the parsed command line; `names` are by default all. Exit if one is unknown."""
    parser.add_argument('names', nargs='*', metavar='NAME', help=', '.join(offered))
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.names) - set(offered))
    if unknown:
        parser.error(f'unknown: {", ".join(unknown)}; there are {", ".join(offered)}')
    arguments.names = arguments.names or list(offered)
    return arguments
