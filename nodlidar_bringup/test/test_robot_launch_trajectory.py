"""The launch file with a joint of ros2_control, simulated with its controllers."""

from nodlidar_bringup.ros.launched import launched_sensor
from nodlidar_msgs.msg import NodStatus
import numpy as np
from observer import Observer
from on_the_room import assert_on_the_room
from sensor_msgs.msg import JointState, PointCloud2
from trajectory_msgs.msg import JointTrajectory

SERVO = '/**: {ros__parameters: {controller: nod_controller}}'
CLOUDS, STATUSES = 40, 80  # two sweeps and more


def test_clouds_lie_on_the_room_and_the_nod_is_in_phase(tmp_path):
    observer, log, servo_params = Observer(), tmp_path / 'launch.log', tmp_path / 'servo.yaml'
    servo_params.write_text(SERVO)
    for kind, topic in (
        (JointTrajectory, 'left/nod_controller/joint_trajectory'),
        (JointState, 'left/joint_states'),
        (NodStatus, 'left/servo/status'),
        (PointCloud2, 'left/points'),
    ):
        observer.subscribe(kind, topic)
    trajectories, states, statuses, clouds = observer.messages.values()
    following = lambda: [each for each in statuses if np.isfinite(each.phase_error)]  # noqa: E731

    def is_enough():
        return len(clouds) >= CLOUDS and len(following()) >= STATUSES

    arguments = 'servo:=trajectory', 'ideal:=true', f'servo_params:={servo_params}'
    with launched_sensor(log, *arguments, 'namespace:=left', 'frame_prefix:=left_') as running:
        observer.spin_until(lambda: is_enough() or not running.running(), 'clouds')
        assert running.running(), log.read_text()
        assert running.interrupt() == 0, log.read_text()
    observer.close()
    assert {tuple(each.joint_names) for each in trajectories} == {('left_nod_joint',)}
    assert {tuple(each.name) for each in states} == {('left_nod_joint',)}
    # A pitch of a cycle before would put them 16 mrad off, 30 mm at 2 m.
    assert_on_the_room(clouds, within=0.005)
    late = [each.phase_error for each in following()[-STATUSES:]]
    assert abs(np.median(late)) < 0.002
