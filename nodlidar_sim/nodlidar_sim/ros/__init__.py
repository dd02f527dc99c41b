"""The node of the simulated base."""
