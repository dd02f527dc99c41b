"""The protocol of LDROBOT's LD06 and LD19: packets and revolutions."""
