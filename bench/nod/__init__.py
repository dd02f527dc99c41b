"""The nod: its phase, limits, schedules, and what it covers."""
