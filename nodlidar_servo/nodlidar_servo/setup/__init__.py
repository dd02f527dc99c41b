"""The command `setup`: finds a servo, shows what it is, and sets it up for the node."""
