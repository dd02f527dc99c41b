"""The scan pattern: directions of the beams, and the cells of a task that they hit."""
