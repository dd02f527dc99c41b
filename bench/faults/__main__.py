"""Injects faults into the launched system, all or some of them."""

from pathlib import Path
import sys

from nodlidar_common.command_line import LineParser
from nodlidar_common.errors import NodlidarError
from rich import get_console

from bench.faults.faults import DURATION, results, TITLE
from bench.shared.report import table


def main() -> None:
    """Print the judgement of the requested faults."""
    parser = LineParser('python -m bench.faults', __doc__)
    parser.add_argument(
        '--duration', type=float, default=DURATION, help='duration of all faults [s]'
    )
    parser.add_argument('--seed', type=int, default=1, help='seed of order and size of the faults')
    parser.add_argument('--only', default='', help='parts of names of faults, separated by commas')
    parser.add_argument('--keep', type=Path, help='folder for bag, logs and each judgement')
    options = parser.parse_args()
    try:
        rows = results(options.duration, options.seed, options.only, options.keep)
    except (NodlidarError, ValueError) as error:
        sys.exit(f'faults: {error}')
    except KeyboardInterrupt:
        sys.exit('faults: interrupted')
    get_console().print(table(TITLE, rows))


if __name__ == '__main__':
    main()
