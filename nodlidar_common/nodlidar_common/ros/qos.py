"""Quality of service of topics and services."""

from rclpy.qos import qos_profile_parameters
from rclpy.qos_overriding_options import QoSOverridingOptions

# A parameter file may override the usual policies of a topic, such as its reliability.
OVERRIDABLE = QoSOverridingOptions.with_default_policies()

# As many requests may wait as for the parameters of a node, 1000. By default it is 10: callers of
# those that came before them would wait for ever.
SERVICE = qos_profile_parameters
