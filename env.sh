# Source this (bash or zsh) for a shell in which `ros2 launch` and `ros2 run` know nodlidar.
# A ROS 2 that is already sourced is used; without one, the ROS 2 of .venv and the packages of underlay/.
_nodlidar_root=$(cd "$(dirname "${BASH_SOURCE[0]:-${(%):-%x}}")" && pwd)
if [ ! -f "$_nodlidar_root/.venv/bin/activate" ]; then
  echo 'nodlidar is not set up yet: run `make build` first' >&2
  return 1
fi
. "$_nodlidar_root/.venv/bin/activate"
if [ -z "${ROS_DISTRO:-}" ] || [ -n "${NODLIDAR_UNDERLAY:-}" ]; then
  export NODLIDAR_UNDERLAY=1 ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3
  export AMENT_PREFIX_PATH="$VIRTUAL_ENV" CMAKE_PREFIX_PATH="$VIRTUAL_ENV"
fi
if [ -n "${ZSH_VERSION:-}" ]; then _nodlidar_shell=zsh; else _nodlidar_shell=bash; fi
if [ -f "$_nodlidar_root/install/local_setup.$_nodlidar_shell" ]; then
  . "$_nodlidar_root/install/local_setup.$_nodlidar_shell"
fi
unset _nodlidar_root _nodlidar_shell
