"""The demo: runs a simulated sensor, records it and measures what it delivers."""
