"""What the drivers of all lidars share."""
