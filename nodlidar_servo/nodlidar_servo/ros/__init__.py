"""The node and its messages."""
