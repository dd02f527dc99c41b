# Source this (bash or zsh) for a shell in which `ros2 launch` and `ros2 run` know nodlidar.
# A ROS 2 that is already sourced is used; without one, the ROS 2 of .venv and the packages of underlay/.
_nodlidar_root=$(cd "$(dirname "${BASH_SOURCE[0]:-${(%):-%x}}")" && pwd)
if [ -n "${NODLIDAR_UNDERLAY:-}" ]; then _nodlidar_ros=wheels; else _nodlidar_ros=${ROS_DISTRO:-wheels}; fi
if [ ! -f "$_nodlidar_root/.venv/ready-$_nodlidar_ros" ]; then
  echo "nodlidar is not set up for ROS from '$_nodlidar_ros' yet: run \`make build\` first" >&2
  return 1
fi
. "$_nodlidar_root/.venv/bin/activate"
if [ "$_nodlidar_ros" = wheels ]; then
  export NODLIDAR_UNDERLAY=1 ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3
  export AMENT_PREFIX_PATH="$VIRTUAL_ENV" CMAKE_PREFIX_PATH="$VIRTUAL_ENV"
fi
if [ -n "${ZSH_VERSION:-}" ]; then _nodlidar_shell=zsh; else _nodlidar_shell=bash; fi
if [ -f "$_nodlidar_root/install/local_setup.$_nodlidar_shell" ]; then
  . "$_nodlidar_root/install/local_setup.$_nodlidar_shell"
fi
[ -w "${HOME:-/nonexistent}" ] || export ROS_LOG_DIR="$_nodlidar_root/log/ros"
unset _nodlidar_root _nodlidar_ros _nodlidar_shell
