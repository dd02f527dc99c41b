"""What the driver's tests share: an emulated lidar and its truth, in virtual time or not."""

from nodlidar_driver.scip.identity import Capabilities
from nodlidar_driver.scip.lidar import Lidar
from nodlidar_driver.scip.scan_account import ScanAccount
from nodlidar_driver.scip.scan_window import scan_window
from nodlidar_driver.scip.scip_port import ScipPort
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
import numpy as np

START_NS = 1_700_000_000_000_000_000
URG = Capabilities('URG-04LX', 20, 5600, 1024, 44, 725, 384, 600)
FULL = scan_window(-4.0, 4.0, 1, 0, URG)


def room(azimuth):
    """Return ranges [m] that tell every azimuth [rad] from every other one."""
    return 2.5 + azimuth


class Truth:
    """Measures the room for an emulated lidar, and remembers when each beam was fired."""

    def __init__(self):
        self._beams = []

    def measure(self, times_ns, azimuth):
        self._beams.append((times_ns, azimuth))
        return room(azimuth)

    def beam_time_ns(self, azimuth, near_ns):
        """Return the instant of the beam at an azimuth that is nearest to a time."""
        times, azimuths = map(np.concatenate, zip(*self._beams, strict=True))
        fired = times[np.isclose(azimuths, azimuth, atol=1e-6)]
        return int(fired[np.argmin(np.abs(fired - near_ns))])


def before(emulator, command, act):
    """Do something as soon as an emulated lidar is sent a command, before it hears that."""
    receive = emulator.receive

    def act_and_receive(data, now_ns):
        if data == command + b'\n':
            act()
        receive(data, now_ns)

    emulator.receive = act_and_receive


class Rig:
    """An emulated lidar on a virtual port; `sent` are the turns that it sent."""

    def __init__(self, **options):
        self.truth = Truth()
        self.clock = VirtualClock(START_NS)
        self.emulator = UrgEmulator(
            self.truth.measure, start_ns=START_NS - 3_000_000_000, **options
        )
        self.port = VirtualPort(self.emulator, self.clock, 1.0)
        self.account = ScanAccount()
        self.sent = []
        self.emulator.on_scan = self.sent.append

    def lidar(self, window=FULL):
        """Return a lidar that streams."""
        lidar = Lidar(ScipPort(self.port, self.clock, 1.0), lambda _: window, self.account)
        lidar.connect()
        return lidar

    def send(self, command):
        """Have the emulator obey a command that the driver knows nothing of."""
        self.port.write(command + b'\n')
        self.port.timeout = 0.5
        self.port.read(100_000)
