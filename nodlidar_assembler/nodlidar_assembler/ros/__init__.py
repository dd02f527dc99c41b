"""The node with its inputs and outputs."""
