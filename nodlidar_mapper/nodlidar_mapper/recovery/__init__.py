"""A robot that is lost is found again."""
