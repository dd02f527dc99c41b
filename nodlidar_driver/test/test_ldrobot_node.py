"""The node of an LD19 on real DDS, with an emulated lidar on a real pseudo-terminal."""

import itertools
import math
import time

from diagnostic_msgs.msg import DiagnosticStatus
from driver_listener import listening
from nodlidar_common.ldrobot import PACKET
from nodlidar_common.stamps import time_ns
from nodlidar_driver.ros.ldrobot_node import LdrobotNode
from nodlidar_sim.devices.streaming_lidar import StreamingLidar
from nodlidar_sim.ports.pseudo_terminals import PseudoTerminals
import numpy as np
import pytest


class Beams:
    """Ranges that tell every azimuth, and when and where each beam was measured."""

    def __init__(self):
        self.times_ns, self.azimuths = [], []

    def measure(self, times_ns, azimuths):
        self.times_ns.append(times_ns)
        self.azimuths.append(azimuths)
        return 3.0 + np.sin(azimuths)


@pytest.fixture
def beams():
    return Beams()


@pytest.fixture
def lidar(beams):
    return StreamingLidar(beams.measure, start_ns=time.time_ns())


@pytest.fixture
def ports(lidar, tmp_path):
    with PseudoTerminals({'lidar': lidar}, {'lidar': tmp_path / 'lidar'}) as ports:
        yield ports


def test_scans_and_diagnostics_tell_what_was_measured_and_when(ports, beams):
    with listening(LdrobotNode, port=ports['lidar']) as listener:
        listener.activate()
        scans = listener.receive(15)
        listener.until(lambda: len(listener.arrivals) >= len(listener.scans), 'arrivals')
        values = listener.connected()
        assert listener.status.hardware_id == ports['lidar']
    times_ns, azimuths = np.concatenate(beams.times_ns), np.concatenate(beams.azimuths)
    for scan in scans:
        stated = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        assert scan.angle_max == pytest.approx(stated[-1], abs=1e-5)
        assert (stated[0], stated[-1]) == pytest.approx((math.pi, -math.pi), abs=0.03)
        stamp_ns = time_ns(scan.header.stamp)
        first = int(np.argmin(np.abs(times_ns - stamp_ns)))
        assert abs(times_ns[first] - stamp_ns) < 5e6  # a busy host reads late
        off = stated[0] - azimuths[first]
        assert abs(math.remainder(off, math.tau)) < 0.3
        np.testing.assert_allclose(scan.ranges, 3.0 + np.sin(stated), atol=0.02)
        assert scan.scan_time == pytest.approx(0.1, rel=0.03)
        assert scan.time_increment == pytest.approx(1 / 4500, rel=0.01)
        assert (scan.range_min, scan.range_max) == pytest.approx((0.02, 12.0))
        assert set(scan.intensities) == {200.0}
    assert scans[0].header.frame_id == 'laser'
    assert float(values['Motor speed'].split()[0]) == pytest.approx(10.0, rel=0.03)
    assert values['Vendor Name'] == 'LDROBOT'


def test_a_lidar_that_is_unplugged_and_plugged_in_again_goes_on(ports):
    with listening(LdrobotNode, port=ports['lidar']) as listener:
        listener.activate()
        listener.receive(3)
        ports.close_device('lidar')
        listener.diagnosed(DiagnosticStatus.ERROR, '')
        ports.reopen('lidar')
        listener.receive(3)
        assert int(listener.connected()['connections']) == 2


def test_silence_is_diagnosed_and_the_port_opened_again(lidar, ports):
    with listening(LdrobotNode, port=ports['lidar'], timeout=1.5) as listener:
        listener.activate()
        listener.receive(3)
        transmit = lidar.transmit
        lidar.transmit = lambda now_ns: transmit(now_ns)[:0]
        listener.diagnosed(DiagnosticStatus.WARN, 'no scan for')
        listener.diagnosed(DiagnosticStatus.ERROR, 'the lidar sent nothing for 1.5 s')
        lidar.transmit = transmit
        listener.receive(3)


def test_lost_bytes_are_counted(lidar, ports):
    transmit, places = lidar.transmit, itertools.count()
    lidar.transmit = lambda now_ns: bytes(
        byte for byte in transmit(now_ns) if next(places) % (4 * PACKET.itemsize)
    )
    with listening(LdrobotNode, port=ports['lidar']) as listener:
        listener.activate()
        scans = listener.receive(5)
        values = listener.diagnosed(DiagnosticStatus.WARN, 'bytes of no packet: ')
        assert int(values['Beams lost']) > 100
        assert int(values['Bytes of no packet']) > 100
    assert np.isnan(scans[-1].ranges).mean() == pytest.approx(0.25, abs=0.03)  # one in four
