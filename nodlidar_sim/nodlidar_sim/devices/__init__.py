"""The emulated lidar and servo, at byte level, in virtual time."""
