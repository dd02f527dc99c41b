"""When nod commands are published, in virtual time."""

from dataclasses import replace

from log_messages import scan_message
from message_fuzz import fed
from node_bench import sensor_log, simulated
from nodlidar_assembler.ros import nod_publisher
from nodlidar_common.ros.messages import nod_from_message
from nodlidar_msgs.action import ScanRegion
from nodlidar_msgs.msg import NodStatus
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest

SCAN = 0.1  # s, from one scan to the next


@pytest.mark.parametrize('rate', [1.0, 4.0, 5.0, 9.0, 40.0])
def test_scans_take_commands_along_about_as_often_as_configured(monkeypatch, rate):
    now = [0]
    published, resets = [], []
    monkeypatch.setattr(nod_publisher, 'steady_ns', lambda: now[0])
    scans = sensor_log(simulated(load_scene('wall', ideal=True), 4.0)).scans
    with fed(f'command_rate:={rate}') as running:
        nod = running.node._nod
        nod._commands.publish = lambda command: published.append(now[0] / 1e9)
        nod._timer = Timer(resets)
        for scan in scans:
            now[0] = scan.stamp_ns
            running.feed('scan', scan_message(scan))
        assert running.node.survival.errors == {}
    intervals = np.diff(published)
    # With the first scan for which a command is nearly due, and never before.
    expected = SCAN * np.ceil(0.9 / rate / SCAN - 1e-3)
    np.testing.assert_allclose(intervals[1:], expected, atol=0.02)
    assert len(resets) == len(published)


@pytest.mark.parametrize(('way', 'limits'), [('up', (-0.2, 0.7)), ('down', (-0.5, 0.4))])
def test_commands_and_limits_of_the_mount_are_positions_of_the_joint(way, limits):
    """The scan plane shall nod from -0.3 to 0.6 rad; the joint is at 0.1 rad where it is level."""
    scan = sensor_log(simulated(load_scene('wall', ideal=True), 0.3)).scans[0]
    own = {'joint_positive': way, 'joint_zero': 0.1, 'pitch_min': -0.3, 'pitch_max': 0.6}
    published = []
    with fed(*(f'{name}:={value}' for name, value in own.items())) as running:
        running.node._nod._commands.publish = published.append
        running.feed('scan', scan_message(scan))
        assert (published[0].pitch_min, published[0].pitch_max) == pytest.approx(limits)
        wanted, joint = running.node._nod.commanded, nod_from_message(published[0])
        # At its highest, the scan plane is at 0.6 rad.
        highest_ns = wanted.reversal_time_ns(1)
        assert joint.pitch(highest_ns) == pytest.approx(limits[1] if way == 'up' else limits[0])
        status = NodStatus(pitch_lower_limit=limits[0] - 0.1, pitch_upper_limit=limits[1] + 0.2)
        running.node._region._statuses.take = lambda: [status]
        mount = (-0.4, 0.8) if way == 'up' else (-0.5, 0.7)
        assert running.node._region.pitch_limits == pytest.approx(mount, abs=2e-6)


@pytest.mark.parametrize('step_ns', [50_000_000, 3600 * 10**9, -3600 * 10**9])
def test_a_region_ends_and_the_nod_goes_on_when_the_clock_is_set(step_ns):
    scan = sensor_log(simulated(load_scene('wall', ideal=True), 0.3)).scans[0]
    with fed() as running:
        node = running.node
        node._nod.follow_lidar(scan)
        region = node._region._begin(ScanRegion.Goal(pitch_min=-0.3, pitch_max=0.3, cell=0.1))
        node._nod.follow_lidar(replace(scan, stamp_ns=scan.stamp_ns + 100_000_000))
        now_ns = node._nod.now_ns()
        before = node._nod.controller._nod_at(now_ns)  # the way to the nod of the region
        node._clock_was_set(step_ns)
        after = node._nod.commanded
        assert (region.is_over, region.message) == (True, 'the clock was set')
        assert 0.0 <= region.duration < 1.0
        assert (after.pitch_min, after.pitch_max) == (-0.6136, 0.6136)
        then_ns = now_ns + step_ns
        assert float(after.pitch(then_ns)) == pytest.approx(float(before.pitch(now_ns)), abs=0.02)


class Timer:
    """Notes that it begins anew."""

    def __init__(self, resets):
        self._resets = resets

    def reset(self):
        self._resets.append(None)
