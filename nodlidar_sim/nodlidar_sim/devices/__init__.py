"""The emulated lidar and servo, at byte level and in virtual time."""
