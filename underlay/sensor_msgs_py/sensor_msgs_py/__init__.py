"""Sensor messages as NumPy arrays: the Python API of Jazzy; see :mod:`point_cloud2`."""
