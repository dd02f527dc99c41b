"""The nod command in effect, whatever moves the joint."""
