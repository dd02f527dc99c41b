"""The driver of Hokuyo lidars, and their protocol SCIP 2.0."""
