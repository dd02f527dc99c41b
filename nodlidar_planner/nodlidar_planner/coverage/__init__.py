"""How a pattern covers the cells of a task, and how soon any nod can cover them."""
