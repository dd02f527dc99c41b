"""The parameters of the assembler node: the union of what its stages are told."""

from dataclasses import dataclass

from nodlidar_assembler.control.scene_monitor import SceneMonitorConfig
from nodlidar_assembler.inputs.joint_input import JointInputConfig
from nodlidar_assembler.inputs.scan_input import ScanInputConfig
from nodlidar_assembler.waiting import WaitingConfig


@dataclass(frozen=True)
class AssemblerConfig(SceneMonitorConfig, WaitingConfig, ScanInputConfig, JointInputConfig):
    """All parameters; each stage takes its own part of them."""
