"""The node on real DDS, with an emulated lidar on a real pseudo-terminal."""

from contextlib import contextmanager
import math
import os
import signal
import subprocess
import sys
import time

from diagnostic_msgs.msg import DiagnosticStatus
from driver_listener import listening, options, SUCCESS, TIMEOUT
from lidar_rig import before, FULL, room, Truth
from nodlidar_common.host_time import HostTime, SteadyTime
from nodlidar_common.ros.executor import Executor
from nodlidar_common.ros.node import run
from nodlidar_common.serial_port import open_port
from nodlidar_common.stamps import time_ns
from nodlidar_driver.ros import lidar_node, scip_node
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.ports.pseudo_terminals import PseudoTerminals
import numpy as np
import pytest
import rclpy
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.task import Future
from sensor_msgs.msg import LaserScan

MAIN = 'from nodlidar_driver.ros.scip_node import main; main()'


@pytest.fixture
def truth():
    return Truth()


@pytest.fixture
def emulator(truth):
    return UrgEmulator(truth.measure, start_ns=time.time_ns(), clock_rate=1.0 + 5e-5)


@pytest.fixture
def ports(emulator, tmp_path):
    with PseudoTerminals({'lidar': emulator}, {'lidar': tmp_path / 'lidar'}) as ports:
        yield ports


def test_scans_and_diagnostics_tell_what_the_lidar_measured_and_when(ports, truth):
    with listening(port=ports['lidar']) as listener:
        listener.activate()
        scans = listener.receive(30)
        listener.until(lambda: len(listener.arrivals) >= len(listener.scans), 'arrivals')
        arrivals = {time_ns(a.time_ref): time_ns(a.header.stamp) for a in listener.arrivals}
        values = listener.connected()
        assert listener.status.hardware_id == ports['lidar']
    scan = scans[-1]
    azimuth = scan.angle_min + scan.angle_increment * np.arange(682)
    assert scan.header.frame_id == 'laser'
    np.testing.assert_allclose(scan.ranges, room(azimuth), atol=0.00051)
    assert scan.angle_min == pytest.approx(-2.08621, abs=1e-5)
    assert scan.angle_max == pytest.approx(2.09235, abs=1e-5)
    assert scan.angle_increment == pytest.approx(0.00613592, abs=1e-8)
    assert scan.time_increment == pytest.approx(0.1 / 1024, rel=1e-3)
    assert scan.scan_time == pytest.approx(0.1, rel=1e-3)
    assert (scan.range_min, scan.range_max) == pytest.approx((0.02, 5.6))
    assert len(scan.intensities) == 0
    stamps = [time_ns(s.header.stamp) for s in scans]
    errors = [stamp - truth.beam_time_ns(FULL.angle_min, stamp) for stamp in stamps]
    # How precise stamps are is told in virtual time; here the host may be busy.
    assert np.median(np.abs(errors)) < 20e6
    for stamp in stamps:
        assert 0.05 < (arrivals[stamp] - stamp) * 1e-9 < 2.0
    assert values['Device ID'] == 'H0000001'
    assert values['Firmware Version'].startswith('3.4')
    assert values['connections'] == '1'
    assert 50.0 < float(values['Computed Latency'].split()[0]) < 2000.0


def test_window_cluster_skip_frame_and_offset_are_applied(ports, truth):
    parameters = {'angle_min': -0.5, 'angle_max': 0.5, 'cluster': 4, 'skip': 1}
    with listening(
        port=ports['lidar'], frame_id='front', stamp_offset=-0.25, **parameters
    ) as listener:
        listener.activate()
        scan = listener.receive(5)[-1]
        offset = Parameter('stamp_offset', value=0.0)
        assert listener.driver.set_parameters([offset])[0].successful
        later = listener.receive(5)[-4:]
        refused = listener.driver.set_parameters([Parameter('skip', value=0)])[0]
    assert not refused.successful
    assert scan.header.frame_id == 'front'
    increment = 2 * math.pi / 1024
    first, count = 303, 163 // 4  # the window is steps 303..465, 40 clusters of 4
    assert len(scan.ranges) == count
    assert scan.angle_increment == pytest.approx(4 * increment)
    assert scan.angle_min == pytest.approx((first + 1.5 - 384) * increment, abs=1e-6)
    assert scan.angle_max == pytest.approx(scan.angle_min + (count - 1) * 4 * increment, abs=1e-5)
    assert scan.scan_time == pytest.approx(0.2, rel=1e-3)
    assert scan.time_increment == pytest.approx(4 * 0.1 / 1024, rel=1e-3)
    stamps = [time_ns(each.header.stamp) for each in later]
    errors = [stamp - truth.beam_time_ns((first - 384) * increment, stamp) for stamp in stamps]
    assert abs(np.median(errors)) < 20e6
    shift = (time_ns(scan.header.stamp) - stamps[-1]) * 1e-9 % 0.2
    assert shift == pytest.approx(0.15, abs=0.03)  # by -0.25 s, and whole scans of 0.2 s


def test_stamps_follow_a_host_whose_clocks_are_slewed(ports, truth, monkeypatch):
    """As chrony does at the most, so that scans are soon late by more than a revolution."""
    rate, begin_ns = 0.08, []

    def slewed(clock):
        real, ahead = clock(), time.monotonic_ns() - begin_ns[0] if begin_ns else 0
        return real + round(rate * ahead)

    def steady():
        return slewed(time.monotonic_ns)

    host_time = HostTime(lambda: slewed(time.time_ns), steady)
    monkeypatch.setattr(lidar_node, 'HostTime', lambda: host_time)
    monkeypatch.setattr(lidar_node, 'SteadyTime', lambda: SteadyTime(steady))
    monkeypatch.setattr(scip_node, 'steady_ns', steady)
    with listening(port=ports['lidar']) as listener:
        listener.activate()
        listener.receive(10)
        began_ns = time.time_ns()
        begin_ns.append(time.monotonic_ns())
        scans = listener.receive(40)[-10:]
        listener.until(lambda: len(listener.arrivals) >= 50, 'arrivals')
    arrivals = {time_ns(a.time_ref): time_ns(a.header.stamp) for a in listener.arrivals}
    stamps = [time_ns(scan.header.stamp) for scan in scans]
    real = [began_ns + round((stamp - began_ns) / (1.0 + rate)) for stamp in stamps]
    errors = [each - truth.beam_time_ns(FULL.angle_min, each) for each in real]
    assert np.median(np.abs(errors)) < 20e6  # here the host may be busy
    assert np.median([arrivals[stamp] - stamp for stamp in stamps]) < 200e6
    assert np.median([scan.scan_time for scan in scans]) == pytest.approx(0.108, rel=1e-3)


@pytest.mark.parametrize('topic', ['/scan', '/driver/arrival'])
def test_publishers_are_reliable_and_volatile_and_can_be_overridden(ports, topic):
    with listening(port=ports['lidar']) as listener:
        info = listener.node.get_publishers_info_by_topic(topic)[0].qos_profile
        assert info.reliability == ReliabilityPolicy.RELIABLE
        assert info.durability == DurabilityPolicy.VOLATILE
    overrides = {f'qos_overrides.{topic}.publisher.reliability': 'best_effort'}
    with listening(port=ports['lidar'], **overrides) as listener:
        info = listener.node.get_publishers_info_by_topic(topic)[0].qos_profile
        assert info.reliability == ReliabilityPolicy.BEST_EFFORT
        for other in {'/scan', '/driver/arrival'} - {topic}:
            info = listener.node.get_publishers_info_by_topic(other)[0].qos_profile
            assert info.reliability == ReliabilityPolicy.RELIABLE


@contextmanager
def used_by_another_program(ports):
    """Open the port exclusively, as another program would."""
    port = open_port(ports['lidar'], 115200, 0.0)
    try:
        yield
    finally:
        port.close()


def test_a_port_that_another_program_uses_after_deactivation(ports, emulator):
    with listening(port=ports['lidar']) as listener:
        listener.activate()
        listener.receive(1)
        assert emulator.sensor.laser
        assert listener.driver.trigger_deactivate() == SUCCESS
        assert not emulator.sensor.laser
        with used_by_another_program(ports):
            assert listener.driver.trigger_activate() == SUCCESS
            listener.diagnosed(DiagnosticStatus.ERROR, 'it is in use by another program')
        listener.receive(2)


def test_a_port_that_is_missing_at_first_and_unplugged_later(ports):
    ports.close_device('lidar')
    with listening(port=ports['lidar']) as listener:
        listener.activate()
        listener.diagnosed(DiagnosticStatus.ERROR, 'does not exist; is the device plugged in?')
        ports.reopen('lidar')
        listener.receive(2)
        ports.close_device('lidar')
        listener.diagnosed(DiagnosticStatus.ERROR, "cannot open serial port '")
        ports.reopen('lidar')
        listener.receive(2)
        assert listener.driver.thread.connection.count == 2


def test_silence_and_a_second_publisher_are_warned_of(ports, emulator):
    with listening(port=ports['lidar']) as listener:
        listener.activate()
        listener.receive(2)
        emulator.sensor.stream = None
        listener.diagnosed(DiagnosticStatus.WARN, 'no scan for')
        listener.receive(2)
        listener.node.create_publisher(LaserScan, 'scan', 10)
        listener.diagnosed(DiagnosticStatus.WARN, '2 publishers on /scan: stop all but one')


def test_a_fault_of_the_lidar_is_reported_and_recovered_from(ports, emulator):
    with listening(port=ports['lidar']) as listener:
        listener.activate()
        listener.receive(2)
        emulator.sensor.faults.come(50)
        listener.diagnosed(DiagnosticStatus.ERROR, 'the lidar answered')
        emulator.sensor.faults.clear()
        listener.receive(2)


def test_a_lidar_that_does_not_stream_is_left_with_its_laser_off(ports, emulator):
    before(emulator, b'MD0044072501000', lambda: emulator.sensor.refuse_next(b'0A'))
    with listening(port=ports['lidar'], reconnect_delay=60.0) as listener:
        listener.activate()
        listener.diagnosed(DiagnosticStatus.ERROR, 'status 0A')
        listener.until(lambda: not emulator.sensor.laser, 'laser off')


def start(parameters, namespace=''):
    return subprocess.Popen(
        [sys.executable, '-c', MAIN, *options(parameters, namespace)],
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {'RCUTILS_LOGGING_BUFFERED_STREAM': '0'},
    )


def test_a_wrong_parameter_ends_the_program_with_a_sentence():
    process = start({'skip': 'often'})
    _, errors = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 2
    assert "'skip' must be of type int, but is 'often'" in errors


@pytest.mark.parametrize(
    ('parameters', 'words'),
    [
        ({'angle_min': -3.2}, "'angle_min' must be between -3.1416 and 3.1416 rad, but is -3.2"),
        ({'angle_min': 1.0, 'angle_max': 0.5}, "'angle_max' must be above angle_min = 1.0"),
    ],
)
def test_other_wrong_parameters_are_named_with_their_limits(parameters, words, capsys):
    assert run(scip_node.ScipNode, options(parameters)) == 2
    assert words in capsys.readouterr().err


class Hearer:
    """Hears a driver in another process, of its own namespace."""

    def __init__(self, namespace):
        rclpy.init()
        self.namespace = namespace
        self.node = rclpy.create_node('hearer', namespace=namespace)
        self._executor = Executor()
        self._executor.add_node(self.node)

    def receive(self):
        future = Future()
        self.node.create_subscription(LaserScan, 'scan', future.set_result, 10)
        self._executor.spin_until_future_complete(future, TIMEOUT)
        return future.result()

    def collect(self, stamps, until):
        """Add the stamps of scans to a list, until a condition holds."""
        if not list(self.node.subscriptions):
            self.node.create_subscription(
                LaserScan, 'scan', lambda scan: stamps.append(time_ns(scan.header.stamp)), 100
            )
        deadline = time.monotonic() + TIMEOUT
        while not until():
            assert time.monotonic() < deadline, 'no scans'
            self._executor.spin_once(timeout_sec=0.05)

    def close(self):
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown()


@pytest.fixture
def hearer(request):
    hearer = Hearer(f'test_{request.node.callspec.id}')
    yield hearer
    hearer.close()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM], ids=['sigint', 'sigterm'])
def test_a_signal_turns_the_laser_off_and_ends_the_program(hearer, ports, emulator, number):
    process = start({'port': ports['lidar'], 'autostart': 'true'}, hearer.namespace)
    try:
        assert len(hearer.receive().ranges) == 682
        assert emulator.sensor.laser
        process.send_signal(number)
        _, errors = process.communicate(timeout=TIMEOUT)
    finally:
        process.kill()
    assert process.returncode == 0, errors
    assert not emulator.sensor.laser


@pytest.mark.parametrize('number', [signal.SIGSTOP], ids=['sigstop'])
def test_a_driver_that_was_stopped_dates_what_waited_by_the_lidar_s_clock(
    hearer, ports, emulator, number
):
    sent, stamps = [], []
    emulator.on_scan = lambda turn: sent.append(turn.times_ns[0])
    process = start({'port': ports['lidar'], 'autostart': 'true'}, hearer.namespace)
    try:
        hearer.collect(stamps, until=lambda: len(stamps) >= 5)
        process.send_signal(number)
        stopped = len(sent)
        hearer.collect(stamps, until=lambda: len(sent) >= stopped + 12)
        process.send_signal(signal.SIGCONT)
        hearer.collect(stamps, until=lambda: stamps[-1] > sent[stopped + 11] + 300_000_000)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=TIMEOUT)
    finally:
        process.kill()
    assert process.returncode == 0, errors
    late = np.array([min((stamp - beam_ns for beam_ns in sent), key=abs) for stamp in stamps])
    # A busy host aligns the clocks worse, but then for all of them.
    assert np.abs(late - np.median(late)).max() < 2e6
    assert np.diff(stamps).min() > 98e6
    assert np.diff(stamps).max() < 102e6


def test_a_killed_driver_s_laser_is_turned_off(ports, emulator):
    deadline = time.monotonic() + TIMEOUT
    with start({'port': ports['lidar'], 'autostart': 'true'}, 'killed') as process:
        while emulator.sensor.stream is None:
            assert time.monotonic() < deadline, 'no stream'
            time.sleep(0.01)
        process.kill()
        while emulator.sensor.laser:
            assert time.monotonic() < deadline, 'the laser is on'
            time.sleep(0.01)
