"""Sensor messages as NumPy arrays: what nodlidar calls of Jazzy's API; see :mod:`point_cloud2`."""
