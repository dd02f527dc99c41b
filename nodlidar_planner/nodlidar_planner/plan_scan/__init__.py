"""The command `plan_scan`: its options, and plans as table, JSON and pictures."""
