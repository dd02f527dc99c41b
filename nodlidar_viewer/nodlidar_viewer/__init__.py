"""The sensor seen live in a browser."""
