"""The actions of launch descriptions."""

from underlay_refusal import refuse

from .declare_launch_argument import DeclareLaunchArgument
from .execute_process import ExecuteProcess
from .opaque_function import OpaqueFunction
from .shutdown import Shutdown

__all__ = ['DeclareLaunchArgument', 'ExecuteProcess', 'OpaqueFunction', 'Shutdown']
__getattr__ = refuse(__name__, __all__)
