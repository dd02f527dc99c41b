"""The command `plan_scan`: its options, and plans as a table, as JSON and as pictures."""
