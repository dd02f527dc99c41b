"""The driver of LDROBOT's LD06 and LD19, and their protocol."""
