"""Limits rounded to few digits so that the rounded value is still allowed."""

from decimal import Context, ROUND_CEILING, ROUND_FLOOR

DIGITS = 4


def rounded_up(value: float) -> str:
    """Return a number of DIGITS that is not below a value."""
    return _rounded(value, ROUND_CEILING)


def rounded_down(value: float) -> str:
    """Return a number of DIGITS that is not above a value."""
    return _rounded(value, ROUND_FLOOR)


def _rounded(value: float, rounding: str) -> str:
    context = Context(prec=DIGITS, rounding=rounding)
    return f'{float(context.create_decimal_from_float(value)):.{DIGITS}g}'
