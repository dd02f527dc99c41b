"""What `probe` finds of an emulated lidar, and how it ends."""

from contextlib import contextmanager
import json
import math
import time

from hypothesis import given
from hypothesis import strategies as st
from lidar_rig import Rig
from nodlidar_driver.base.reader import Reader
from nodlidar_driver.commands.entry_points import probe
from nodlidar_driver.commands.probe import lines
from nodlidar_driver.config import ScipConfig
from nodlidar_driver.ldrobot.lidar import LdrobotLidar
from nodlidar_driver.probing import probe_ldrobot, probe_scip, residual
from nodlidar_driver.scan_picture import picture
from nodlidar_driver.scip.lidar import Lidar
from nodlidar_driver.scip.scip_port import ScipPort
from nodlidar_sim.devices.device import SilentDevice
from nodlidar_sim.devices.scip_models import SCIP_MODELS
from nodlidar_sim.devices.streaming_lidar import StreamingLidar
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.ports.pseudo_terminals import PseudoTerminals
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
import numpy as np
import pytest


def probed(seconds, **options):
    rig = Rig(**options)
    lidar = Lidar(ScipPort(rig.port, rig.clock, 1.0), ScipConfig().window, rig.account)
    lidar.connect()
    return probe_scip(lidar, rig.account, seconds)


@contextmanager
def lidar_at_a_port():
    emulator = UrgEmulator(
        lambda times_ns, azimuth: 2.5 + azimuth,
        start_ns=time.time_ns(),
        model=SCIP_MODELS['UST-10LX'],
    )
    with PseudoTerminals({'lidar': emulator}) as ports:
        yield emulator, ports['lidar']


@pytest.mark.parametrize(('name', 'rate'), [('URG-04LX-UG01', 10.0), ('UST-10LX', 40.0)])
def test_rate_drift_and_beams_are_those_of_the_lidar(name, rate):
    ppm = 80.0
    found = probed(20.0, model=SCIP_MODELS[name], clock_rate=1.0 + ppm * 1e-6)
    assert found.nominal_rate == pytest.approx(rate)
    assert found.rate == pytest.approx(rate, rel=2e-3)
    assert found.clock.drift_ppm == pytest.approx(ppm, abs=10.0)
    assert found.clock.residual < 0.5e-3
    assert found.seen + found.nothing + found.too_near + found.doubtful == pytest.approx(1.0)
    assert found.scans == pytest.approx(20.0 * rate, abs=3)
    assert not found.warnings


def test_an_ld19_is_probed():
    ppm, clock = 80.0, VirtualClock(time.time_ns())
    emulator = StreamingLidar(ahead, start_ns=clock(), clock_rate=1.0 + ppm * 1e-6)
    lidar = LdrobotLidar(Reader(VirtualPort(emulator, clock), clock, 1.0), (-1.0, 1.5), 16)
    lidar.connect()
    found = probe_ldrobot(lidar, 20.0)
    assert found.rate == pytest.approx(found.nominal_rate, rel=5e-3)
    assert found.clock.drift_ppm == pytest.approx(ppm, abs=10.0)
    assert found.scans == pytest.approx(200, abs=3)
    assert found.limits == pytest.approx((-1.0, 1.5), abs=0.02)
    assert found.seen == pytest.approx(0.8, abs=0.01)  # nothing right of -0.5 rad
    assert found.nothing == pytest.approx(0.2, abs=0.01)
    near = np.isfinite(found.ranges)
    assert found.ranges[near] == pytest.approx(2.5 + found.azimuths[near], abs=0.01)
    assert not found.warnings
    assert not found.lost
    assert dict(lines(found))['lidar'] == 'LD06 or LD19, LDROBOT'


def ahead(times_ns, azimuth):
    azimuth = (azimuth + math.pi) % math.tau - math.pi
    return np.where(azimuth > -0.5, 2.5 + azimuth, math.inf)


def test_numbers_are_json():
    numbers = json.loads(json.dumps(probed(1.0).numbers()))
    assert numbers['identity']['capabilities']['steps_per_revolution'] == 1024
    assert numbers['angle_min'] == pytest.approx(-340 * math.tau / 1024)


@given(
    st.lists(st.integers(1, 5), min_size=2, max_size=40),
    st.floats(0.02, 0.11),
    st.integers(0, 2**62),
)
def test_even_revolutions_leave_no_residual_however_many_are_missing(steps, revolution, start):
    numbers = np.cumsum(steps)
    stamps = start + np.round(numbers * revolution * 1e9).astype(np.int64)
    assert residual(stamps, revolution * 1.001) < 2e-9


def test_the_residual_is_the_deviation_from_a_line():
    late = np.tile([1, -1, -1, 1], 25) * 200_000  # ns; without slope
    stamps = np.arange(100) * 25_000_000 + late
    assert residual(stamps, 0.025) == pytest.approx(200e-6, rel=1e-6)


@given(st.integers(3, 80), st.integers(3, 40), st.booleans(), st.integers(0, 2**32))
def test_a_picture_has_its_size_and_nearly_all_points(columns, rows, braille, seed):
    points = np.random.default_rng(seed).normal(0.0, 3.0, (200, 2))
    drawn, line = picture(points, columns, rows, braille)
    assert len(drawn) == rows
    assert max(map(len, drawn)) <= columns
    assert drawn[rows // 2][columns // 2] == '+'
    assert line > 0.0


def test_forward_is_up_and_left_is_left():
    drawn, line = picture(np.array([[4.0, 0.0]]), 21, 11, braille=False)
    assert drawn[0] == ' ' * 10 + '*'
    assert line == pytest.approx(4.0 / 5)
    drawn, _ = picture(np.array([[0.0, 4.0]]), 21, 11, braille=False)
    assert drawn[5] == '*' + ' ' * 9 + '+'


def test_a_picture_without_points_shows_the_lidar():
    assert ''.join(picture(np.empty((0, 2)), 9, 5)[0]).strip() == '+'


def test_the_command_prints_numbers_and_leaves_the_laser_off(capsys):
    with lidar_at_a_port() as (emulator, port):
        assert probe(['--port', port, '--seconds', '0.2', '--json']) == 0
        assert not emulator.sensor.laser
    numbers = json.loads(capsys.readouterr().out)
    assert numbers['identity']['capabilities']['steps_per_revolution'] == 1440
    assert numbers['rate'] == pytest.approx(40.0, rel=0.05)


def test_the_command_prints_what_an_ld19_sees(capsys):
    emulator = StreamingLidar(ahead, start_ns=time.time_ns())
    with PseudoTerminals({'lidar': emulator}) as ports:
        assert probe(['--lidar', 'LD19', '--port', ports['lidar'], '--seconds', '0.2']) == 0
    shown = capsys.readouterr().out
    assert 'LD06 or LD19, LDROBOT' in shown
    assert 'uneven motor' in shown
    assert '+ is the lidar' in shown


def test_an_ld19_that_is_taken_for_a_hokuyo_is_told_apart(capsys):
    emulator = StreamingLidar(ahead, start_ns=time.time_ns())
    with PseudoTerminals({'lidar': emulator}) as ports:
        assert probe(['--port', ports['lidar']]) == 1
    assert '--lidar LD19' in capsys.readouterr().err


def test_a_hokuyo_that_is_taken_for_an_ld19_is_an_error(capsys):
    with lidar_at_a_port() as (_, port):
        assert probe(['--lidar', 'LD19', '--port', port]) == 1
    assert 'LD06 or LD19' in capsys.readouterr().err


def test_an_interrupt_leaves_the_laser_off(monkeypatch):
    def interrupt(lidar, account, seconds):
        raise KeyboardInterrupt

    monkeypatch.setattr('nodlidar_driver.commands.probe.probe_scip', interrupt)
    with lidar_at_a_port() as (emulator, port):
        assert probe(['--port', port]) == 130
        assert not emulator.sensor.laser


@pytest.mark.parametrize(
    ('arguments', 'status', 'text'),
    [
        (['--port', '/dev/missing'], 1, 'does not exist'),
        (['--port', 'tcp://127.0.0.1:1'], 1, 'cannot connect'),
        (['--seconds', '0'], 2, "'--seconds' must be above 0"),
    ],
)
def test_errors_are_in_words(arguments, status, text, capsys):
    assert probe(arguments) == status
    assert text in capsys.readouterr().err


def test_a_port_without_a_lidar_is_named(capsys):
    with PseudoTerminals({'lidar': SilentDevice()}) as ports:
        assert probe(['--port', ports['lidar']]) == 1
    error = capsys.readouterr().err
    assert 'no lidar of SCIP 2.0 answers' in error
    assert 'nodlidar_bringup doctor' in error
