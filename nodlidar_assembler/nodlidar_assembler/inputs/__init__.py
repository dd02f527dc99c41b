"""Messages as checked values; what cannot be right is refused."""
