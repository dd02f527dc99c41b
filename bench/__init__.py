"""Measurements that the documentation quotes: `make bench` prints them all.

Each is a module with TITLE and results(), in the folder that says what it measures.
"""
