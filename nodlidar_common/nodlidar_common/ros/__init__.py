"""What the nodes share: parameters, diagnostics, steady timers, devices that stay safe."""
