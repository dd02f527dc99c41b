"""Measurements that the documentation quotes: `make bench` prints them all."""
