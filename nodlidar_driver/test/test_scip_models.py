"""Lidars of other layouts, as they report them, and lidars behind TCP."""

from contextlib import contextmanager
import math
import os
import select
import socket
import threading
import time

from lidar_rig import Rig
from nodlidar_common.errors import DeviceError, PortError
from nodlidar_common.guard import Guard
from nodlidar_common.serial_port import close_port, open_port
from nodlidar_driver.config import ScipConfig
from nodlidar_driver.scip.lidar import Lidar
from nodlidar_driver.scip.scan_account import ScanAccount
from nodlidar_driver.scip.scip_answer import STOP
from nodlidar_driver.scip.scip_port import ScipPort
from nodlidar_sim.devices.scip_models import SCIP_MODELS
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.ports.pseudo_terminals import PseudoTerminals
import numpy as np
import pytest

OTHERS = [name for name in SCIP_MODELS if name != 'URG-04LX-UG01']


def started(rig, **config):
    lidar = Lidar(ScipPort(rig.port, rig.clock, 1.0), ScipConfig(**config).window, rig.account)
    lidar.connect()
    return lidar


@pytest.mark.parametrize('name', OTHERS)
def test_a_lidar_is_taken_for_what_it_says_of_itself(name):
    rig = Rig(model=SCIP_MODELS[name])
    lidar = started(rig)
    assert lidar.window.count == 1081
    assert lidar.window.angle_min == pytest.approx(-0.75 * math.pi)
    scans = [lidar.read() for _ in range(400)]
    azimuth = lidar.window.angle_min + lidar.window.angle_increment * np.arange(1081)
    expected = 2.5 + azimuth
    near = expected < SCIP_MODELS[name].range_min_mm * 1e-3
    np.testing.assert_allclose(scans[-1].ranges[~near], expected[~near], atol=0.00051)
    errors = [
        (scan.stamp_ns - rig.truth.beam_time_ns(azimuth[0], scan.stamp_ns)) / 1e6
        for scan in scans[100::7]
    ]
    assert np.abs(errors).max() < 0.55  # ms; 25 ms are whole milliseconds of the timer
    assert scans[-1].revolution == pytest.approx(0.025, rel=1e-4)
    assert rig.account.lost.total() - rig.account.lost['settling'] == 0


def test_a_clock_that_drifts_lets_the_fractions_be_found():
    rig = Rig(model=SCIP_MODELS['UST-10LX'], clock_rate=1.0 + 8e-5)
    lidar = started(rig)
    scans = [lidar.read() for _ in range(1200)]
    first = lidar.window.angle_min
    errors = [
        (scan.stamp_ns - rig.truth.beam_time_ns(first, scan.stamp_ns)) / 1e6
        for scan in scans[600::11]
    ]
    assert np.sqrt(np.mean(np.square(errors))) < 0.5


def test_a_lidar_that_sends_several_echoes_is_refused_by_name():
    rig = Rig(model=SCIP_MODELS['UTM-30LX'])
    lidar = started(rig)
    lidar.read()
    receive = rig.emulator.transmit
    rig.emulator.transmit = lambda now_ns: receive(now_ns).replace(b'MD', b'ND')
    with pytest.raises(DeviceError, match='several echoes'):
        lidar.read()


@contextmanager
def behind_tcp(terminal):
    """Pass on bytes between one TCP connection and a terminal; yield the port."""
    server = socket.create_server(('127.0.0.1', 0))
    port = os.open(terminal, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def pass_on():
        connection, _ = server.accept()
        with connection:
            while True:
                for ready in select.select([connection, port], [], [], 5.0)[0]:
                    if ready is connection:
                        data = connection.recv(4096)
                        if not data:
                            return
                        os.write(port, data)
                    else:
                        connection.sendall(os.read(port, 4096))

    thread = threading.Thread(target=pass_on)
    thread.start()
    yield server.getsockname()[1]
    thread.join()
    os.close(port)
    server.close()


def test_a_lidar_behind_tcp_streams_and_is_switched_off_by_its_guard():
    emulator = UrgEmulator(
        lambda times_ns, azimuth: 2.5 + azimuth,
        start_ns=time.time_ns(),
        model=SCIP_MODELS['UST-20LX'],
    )
    with PseudoTerminals({'lidar': emulator}) as terminals, behind_tcp(terminals['lidar']) as tcp:
        port = open_port(f'tcp://127.0.0.1:{tcp}', 115200, 0.1)
        guard = Guard(port.fileno(), STOP)
        account = ScanAccount()
        lidar = Lidar(ScipPort(port, time.monotonic_ns, 1.0), ScipConfig().window, account)
        lidar.connect()
        stamps, due = [lidar.read().stamp_ns], account.due
        stamps += [lidar.read().stamp_ns for _ in range(39)]
        revolutions = np.diff(stamps) / 1e9 / 0.025
        assert revolutions == pytest.approx(np.rint(revolutions), abs=0.08)
        assert np.rint(revolutions).min() >= 1
        # A scan that a busy host delays cannot always be dated. It is counted then.
        assert np.rint(revolutions).sum() == account.due - due
        assert emulator.sensor.laser
        guard.trigger()
        deadline = time.monotonic() + 5.0
        while emulator.sensor.laser and time.monotonic() < deadline:
            select.select([], [], [], 0.02)
        assert not emulator.sensor.laser
        close_port(port)


def test_a_port_that_nobody_listens_on_is_named():
    with pytest.raises(PortError, match=r"cannot connect to 'tcp://127.0.0.1:1'"):
        open_port('tcp://127.0.0.1:1', 115200, 0.1)
    with pytest.raises(PortError, match='cannot connect'):
        open_port('tcp://127.0.0.1:abc', 115200, 0.1)
