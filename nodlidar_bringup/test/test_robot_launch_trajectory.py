"""The launch file with a joint of ros2_control and an RPLIDAR's driver, both simulated."""

from nodlidar_bringup.ros.launched import launched_sensor
from nodlidar_msgs.msg import NodStatus
import numpy as np
from observer import Observer
from on_the_room import assert_on_the_room_all_around, CLOUDS
from sensor_msgs.msg import JointState, LaserScan, PointCloud2
from trajectory_msgs.msg import JointTrajectory

SERVO = '/**: {ros__parameters: {controller: nod_controller}}'
STATUSES = 80  # two sweeps and more


def test_clouds_lie_on_the_room_and_the_nod_is_in_phase(tmp_path):
    observer, log, servo_params = Observer(), tmp_path / 'launch.log', tmp_path / 'servo.yaml'
    servo_params.write_text(SERVO)
    for kind, topic in (
        (JointTrajectory, 'left/nod_controller/joint_trajectory'),
        (JointState, 'left/joint_states'),
        (NodStatus, 'left/servo/status'),
        (LaserScan, 'left/scan'),
        (PointCloud2, 'left/points'),
    ):
        observer.subscribe(kind, topic)
    trajectories, states, statuses, scans, clouds = observer.messages.values()
    following = lambda: [each for each in statuses if np.isfinite(each.phase_error)]  # noqa: E731

    def is_enough():
        return len(clouds) >= CLOUDS and len(following()) >= STATUSES

    arguments = 'servo:=trajectory', 'lidar:=rplidar', f'servo_params:={servo_params}'
    names = 'namespace:=left', 'frame_prefix:=left_'
    with launched_sensor(log, *arguments, *names, 'ideal:=true') as running:
        observer.spin_until(lambda: is_enough() or not running.running(), 'clouds')
        assert running.running(), log.read_text()
        assert running.interrupt() == 0, log.read_text()
    observer.close()
    assert {tuple(each.joint_names) for each in trajectories} == {('left_nod_joint',)}
    assert {tuple(each.name) for each in states} == {('left_nod_joint',)}
    assert {scan.header.frame_id for scan in scans} == {'left_laser'}
    assert_on_the_room_all_around(scans, 720, clouds)
    late = [each.phase_error for each in following()[-STATUSES:]]
    assert abs(np.median(late)) < 0.002
