"""Ways to reach the devices: by call, or by pseudo-terminal."""
