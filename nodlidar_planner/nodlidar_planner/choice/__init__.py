"""The choice of the nod by completion, revisits or holes."""
