"""The parameters of the assembler node: the union of those of its stages."""

from dataclasses import dataclass

from nodlidar_assembler.clouds.level_ranges import LevelScanConfig
from nodlidar_assembler.clouds.scan_memory import ScanMemoryConfig
from nodlidar_assembler.control.adaptive_limits import AdaptiveLimitsConfig
from nodlidar_assembler.control.coverage_monitor import CoverageConfig
from nodlidar_assembler.inputs.joint_input import JointInputConfig
from nodlidar_assembler.inputs.scan_input import ScanInputConfig
from nodlidar_assembler.scan_assembler import ScanAssemblerConfig


@dataclass(frozen=True)
class AssemblerConfig(
    CoverageConfig,
    AdaptiveLimitsConfig,
    LevelScanConfig,
    ScanMemoryConfig,
    ScanAssemblerConfig,
    ScanInputConfig,
    JointInputConfig,
):
    """All parameters; each stage reads those of its own base class."""
