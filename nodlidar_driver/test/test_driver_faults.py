"""The driver without ROS under faults, in virtual time: right stamps, and every scan counted."""

from contextlib import suppress

from lidar_rig import FULL, Rig, START_NS
from nodlidar_common.errors import DeviceError
from nodlidar_driver.scip.lidar import Lidar
from nodlidar_driver.scip.scip_port import ScipPort
from nodlidar_sim.devices.faults import FaultyDevice
from nodlidar_sim.ports.virtual_port import VirtualPort
import numpy as np
import pytest


class FaultyRig(Rig):
    """An emulated lidar behind a bad line, and the scans that the driver makes of it."""

    def __init__(self, **options):
        super().__init__(**options)
        self.line = FaultyDevice(self.emulator, seed=7)
        self.port = VirtualPort(self.line, self.clock, 1.0)
        self.stamps = []

    def run(self, seconds):
        """Read for a time [s], connecting anew as the node does."""
        end_ns = self.clock() + round(seconds * 1e9)
        while self.clock() < end_ns:
            port = ScipPort(self.port, self.clock, 1.0, lambda: self.clock() < end_ns)
            lidar = Lidar(port, lambda _: FULL, self.account)
            with suppress(DeviceError):
                lidar.connect()
                while True:
                    self.stamps.append(lidar.read().stamp_ns)
            with suppress(DeviceError):
                lidar.disconnect()
            self.clock.advance_to(self.clock() + 500_000_000)

    def errors(self):
        """Return by how much each stamp is wrong [ms]."""
        first = np.array([turn.times_ns[0] for turn in self.sent])
        nearest = np.abs(first[:, None] - np.array(self.stamps)).min(axis=0)
        return nearest / 1e6


@pytest.mark.parametrize('stall', [0.2, 1.1, 2.0, 3.0, 9.0])
def test_a_stall_costs_no_stamp_and_no_scan_that_the_port_kept(stall):
    rig = Rig(clock_rate=1.0 + 5e-5)
    lidar = rig.lidar()
    stamps = [lidar.read().stamp_ns for _ in range(30)]
    rig.clock.advance_to(rig.clock() + round(stall * 1e9))
    while rig.clock() < START_NS + round((8.0 + stall) * 1e9):
        stamps.append(lidar.read().stamp_ns)
    truths = [rig.truth.beam_time_ns(FULL.angle_min, stamp) for stamp in stamps]
    assert np.abs(np.subtract(stamps, truths)).max() < 700_000
    assert np.diff(stamps).min() > 99e6
    assert (rig.account.lost.total() > 0) == (stall > 3.0)  # more than the port holds
    lidar.disconnect()
    assert rig.account.due == len(rig.sent)


@pytest.mark.parametrize(
    'fault',
    [
        {'corrupt_rate': 3e-4},
        {'drop_rate': 3e-4},
        {'insert_rate': 3e-4},
        {'corrupt_rate': 1e-4, 'drop_rate': 1e-4, 'insert_rate': 1e-4},
        {'mute': True},
        {'delay_ns': 300_000_000},
        {'jitter_ns': 80_000_000},
        {'delay_ns': 1_700_000_000},
    ],
)
def test_under_faults_stamps_are_right_and_every_scan_is_counted(fault):
    rig = FaultyRig(clock_rate=1.0 - 4e-5)
    rig.run(4.0)
    for name, value in fault.items():
        setattr(rig.line, name, value)
    rig.run(6.0)
    rig.line.mend()
    mended_ns = rig.clock()
    rig.run(6.0)
    assert rig.errors().max() < 2.0
    assert rig.stamps[-1] > rig.clock() - 800_000_000
    assert min(stamp for stamp in rig.stamps if stamp > mended_ns) < mended_ns + 3_000_000_000
    assert rig.account.published == len(rig.stamps) == len(set(rig.stamps))
    # What a connection that fails asked for and never saw counts where it was received only.
    assert rig.account.due == pytest.approx(len(rig.sent), abs=0.05 * len(rig.sent) + 3)


@pytest.mark.parametrize('wrong', [-30, 30, 200])
def test_a_wrong_time_with_a_right_sum_is_dropped_and_counted(wrong):
    rig = Rig()

    def spoil(turn):
        if len(rig.sent) in (0, 20, 40):
            turn.timer += wrong
        rig.sent.append(turn)

    rig.emulator.on_scan = spoil
    lidar = rig.lidar()
    stamps = [lidar.read().stamp_ns for _ in range(60)]
    truths = [rig.truth.beam_time_ns(FULL.angle_min, stamp) for stamp in stamps]
    assert np.abs(np.subtract(stamps, truths)).max() < 500_000
    assert +rig.account.lost == {'settling': 1, 'timestamp': 2}


@pytest.mark.parametrize('tenths', range(10))
def test_scans_before_a_stop_that_is_not_confirmed_are_counted(tenths):
    rig = FaultyRig()
    lidar = Lidar(ScipPort(rig.port, rig.clock, 1.0), lambda _: FULL, rig.account)
    lidar.connect()
    for _ in range(10):
        lidar.read()
    rig.clock.advance_to(rig.clock() + tenths * 10_000_000)
    rig.line.mute = True
    with pytest.raises(DeviceError):
        lidar.read()
    with pytest.raises(DeviceError):
        lidar.disconnect()
    assert rig.account.due == len(rig.sent)
