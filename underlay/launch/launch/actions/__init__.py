"""What launch descriptions do."""

from underlay_refusal import refuse

from .declare_launch_argument import DeclareLaunchArgument
from .execute_process import ExecuteProcess
from .shutdown import Shutdown

__all__ = ['DeclareLaunchArgument', 'ExecuteProcess', 'Shutdown']
__getattr__ = refuse(__name__, __all__)
