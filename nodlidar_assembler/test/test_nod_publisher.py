"""When nod commands are published, in virtual time."""

from log_messages import scan_message
from message_fuzz import fed
from node_bench import sensor_log, simulated
from nodlidar_assembler.ros import nod_publisher
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


class Timer:
    """Notes that it begins anew."""

    def __init__(self, resets):
        self._resets = resets

    def reset(self):
        self._resets.append(None)
