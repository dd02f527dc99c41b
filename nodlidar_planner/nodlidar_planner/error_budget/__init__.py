"""The expected error of a point, by its sources, from the data of the devices and the nod."""
