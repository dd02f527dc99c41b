"""What the commands of this package have in common."""

import argparse
from typing import NoReturn


class LineParser(argparse.ArgumentParser):
    """A parser whose errors are one line, and whose options are not abbreviated."""

    def __init__(self, prog: str, description: str | None) -> None:
        super().__init__(prog=prog, description=description, allow_abbrev=False)

    def error(self, message: str) -> NoReturn:
        """Exit with status 2 and a line on stderr."""
        self.exit(2, f'{self.prog}: {message}\n')
