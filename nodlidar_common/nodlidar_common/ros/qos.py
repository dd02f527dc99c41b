"""Quality of service of topics."""

from rclpy.qos_overriding_options import QoSOverridingOptions

# A parameter file may override the usual policies of a topic, such as its reliability.
OVERRIDABLE = QoSOverridingOptions.with_default_policies()
