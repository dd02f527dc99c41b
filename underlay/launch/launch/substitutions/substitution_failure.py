"""The error of substitutions."""


class SubstitutionFailure(RuntimeError):  # noqa: N818
    """A substitution can't be performed."""
