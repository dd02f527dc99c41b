"""Shared parts of the nodes: parameters, diagnostics, steady timers, device nodes."""
