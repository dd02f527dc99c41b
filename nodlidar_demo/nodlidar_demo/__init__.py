"""The demo: records the launched sensor in a simulated scene, measures and shows the result."""
