"""The supported servo models, and their registers."""
