"""Time, bytes and latency: of computation, of nodes, of the page."""
