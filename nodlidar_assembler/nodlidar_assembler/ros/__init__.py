"""The node, what it hears and what it publishes."""
