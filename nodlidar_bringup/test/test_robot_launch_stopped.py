"""A node that stands still for some seconds, as on a host that swaps, and goes on."""

import signal

from diagnostic_msgs.msg import DiagnosticArray
from nodlidar_bringup.ros.launched import launched_sensor
from observer import Observer
import psutil
from sensor_msgs.msg import JointState, PointCloud2

STATES, SCANS = 300, 30  # in the time for which it stands still, and about as many scans


def test_an_assembler_that_stood_still_gets_every_joint_state_of_that_time(tmp_path):
    observer = Observer()
    topics = {'joint_states': JointState, 'points': PointCloud2, '/diagnostics': DiagnosticArray}
    for topic, message_type in topics.items():
        observer.subscribe(message_type, topic)
    states, clouds = observer.messages['joint_states'], observer.messages['points']

    def values():
        return {
            value.key: int(value.value)
            for array in observer.messages['/diagnostics']
            for status in array.status
            if status.name == 'assembler: clouds'
            for value in status.values
            if value.value.isdigit()
        }

    with launched_sensor(tmp_path / 'launch.log', 'scene:=wall', 'ideal:=true') as running:
        observer.spin_until(lambda: len(clouds) > 10 and values(), 'clouds')
        lost = values().get('lost before they arrived: joint states', 0)
        processes = psutil.Process(running.process.pid).children(recursive=True)
        (assembler,) = [each for each in processes if each.name() == 'assembler']
        assembler.send_signal(signal.SIGSTOP)
        try:
            before = len(states)
            observer.spin_until(lambda: len(states) > before + STATES, 'joint states')
        finally:
            assembler.send_signal(signal.SIGCONT)
        before = values()['clouds']
        observer.spin_until(lambda: values()['clouds'] > before + SCANS, 'clouds of that time')
        assert values().get('lost before they arrived: joint states', 0) == lost
    observer.close()
