"""The node that publishes a robot's joint states and URDF as transforms: that of Jazzy."""
