"""What is planned for is the lidar that sends the scans, not the URG-04LX."""

from dataclasses import replace
import math

from assembling import assembled_of
from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_LASER_POSE, ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.coverage_monitor import CoverageMonitor
from nodlidar_assembler.control.lidar_view import LidarView, nod_for, task_for
from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_assembler.control.nod_controller import NodController
import numpy as np
import pytest

S = 1_000_000_000
START_NS = 1_700_000_000 * S


def lidar(beams, angle_min, angle_max, rate, steps):
    """Return the geometry of a lidar, rounded as in messages."""
    increment = np.float32((angle_max - angle_min) / (beams - 1))
    return ScanGeometry(
        beams, float(np.float32(angle_min)), float(increment), 1.0 / (rate * steps), 0.02, 30.0
    )


URG = lidar(682, (44 - 384) * math.tau / 1024, (725 - 384) * math.tau / 1024, 10.0, 1024)
# Data sheets: Hokuyo UST-10LX, 0.25 degrees over 270 degrees in 25 ms; LDROBOT LD19, about 450
# points in a revolution at 10 Hz; Slamtec RPLIDAR A1, 720 points at 5.5 Hz.
UST = lidar(1081, -0.75 * math.pi, 0.75 * math.pi, 40.0, 1440)
LD19 = lidar(450, 0.0, math.tau * 449 / 450, 10.0, 450)
RPLIDAR = lidar(720, -math.pi, math.pi, 5.5, 719)  # as its driver computes the increment
LIDARS = {'URG-04LX': URG, 'UST-10LX': UST, 'LD19': LD19, 'RPLIDAR A1': RPLIDAR}
of_every_lidar = pytest.mark.parametrize('geometry', LIDARS.values(), ids=LIDARS)


def config_for(geometry, **others):
    """Return parameters with a cell of 0.1 rad, which every lidar sees, at its own N_L."""
    config = AssemblerConfig(object_size=0.2, **others)
    return replace(config, **{
        key: getattr(nod_for(config, geometry), key)
        for key in ('steps_per_revolution', 'samples_per_sweep')
    })  # fmt: skip


@pytest.mark.parametrize(
    ('name', 'steps', 'width', 'rate', 'full'),
    [
        ('URG-04LX', 1024, 681 * math.tau / 1024, 10.0, False),
        ('UST-10LX', 1440, 1.5 * math.pi, 40.0, False),
        ('LD19', 450, math.tau * 449 / 450, 10.0, True),
        ('RPLIDAR A1', 719, math.tau * 718 / 719, 5.5, True),
    ],
)
def test_steps_window_and_rate_are_those_of_the_scan(name, steps, width, rate, full):
    view = LidarView(NodConfig())
    assert view.look(LIDARS[name])
    task, config = view.task, view.config
    assert (config.steps_per_revolution, task.steps_per_revolution) == (steps, steps)
    assert task.window_max - task.window_min == pytest.approx(width)
    assert task.full_circle == full
    assert task.scan_rate == pytest.approx(rate, rel=1e-5)
    assert math.gcd(config.samples_per_sweep, steps) == 1


@of_every_lidar
def test_each_beam_has_its_own_step_and_a_column_and_each_column_beams(geometry):
    task = task_for(nod_for(NodConfig(object_size=0.2), geometry), geometry)
    azimuth = Beams(geometry, REFERENCE_LASER_POSE).azimuth
    step, column = task.step_at(azimuth), task.column_of_step()
    repeated = geometry is RPLIDAR  # its last beam is where the first one is
    assert len(set(step)) == len(step) - repeated
    assert (column[step] >= 0).all()
    assert set(column[step]) == set(range(task.columns))
    others = np.setdiff1d(np.arange(task.steps_per_revolution), step)
    assert (column[others] == -1).all()
    np.testing.assert_allclose(
        np.abs((task.step_azimuth()[step] - azimuth + math.pi) % math.tau - math.pi), 0, atol=1e-3
    )


@given(
    st.integers(60, 3000),
    st.floats(0.05, 0.99),
    st.floats(-math.pi, math.pi),
    st.sampled_from([1, -1]),
    st.integers(1, 4),
)
def test_any_window_is_seen_whole_and_nothing_beyond_it(steps, share, first, sign, thinned):
    beams = max(1, int(share * steps / thinned) - 2)
    increment = float(np.float32(sign * thinned * math.tau / steps))
    geometry = ScanGeometry(beams, float(np.float32(first)), increment, 0.1 / steps, 0.0, 30.0)
    config = NodConfig(steps_per_revolution=steps, object_size=0.5)
    task = task_for(nod_for(config, geometry), geometry)
    assert task.steps_per_revolution == steps
    azimuth = Beams(geometry, REFERENCE_LASER_POSE).azimuth
    inside = task.column_of_step() >= 0
    assert inside[task.step_at(azimuth)].all()
    assert inside.sum() == (beams - 1) * thinned + 1


def test_a_nod_for_another_lidar_keeps_its_speed_or_that_of_the_servo():
    config = NodConfig(samples_per_sweep=4001)
    assert nod_for(config, URG) is config
    for geometry, beam_period in ((LD19, 0.1 / 450), (UST, 0.025 / 1440)):
        samples = nod_for(config, geometry).samples_per_sweep
        assert samples == pytest.approx(4001 * 0.1 / 1024 / beam_period, abs=6)
    fast = nod_for(NodConfig(samples_per_sweep=101), UST)
    speed = (fast.pitch_max - fast.pitch_min) / (fast.samples_per_sweep * 0.025 / 1440)
    assert 0.98 * fast.max_nod_speed < speed <= fast.max_nod_speed
    timeless = replace(UST, time_increment=0.0)
    assert nod_for(config, timeless).samples_per_sweep == pytest.approx(4001 * 1440 / 1024, abs=6)


def test_what_differs_from_scan_to_scan_is_still_the_same_lidar():
    view = LidarView(NodConfig(steps_per_revolution=450))
    assert view.look(LD19)
    before = view.config, view.task
    for beams in (448, 452, 447, 453, 450):
        assert not view.look(lidar(beams, 0.0, math.tau * (beams - 1) / beams, 10.1, beams))
    assert (view.config, view.task) == before
    assert view.look(UST)
    assert view.look(LD19)
    assert view.config == before[0]


@pytest.mark.parametrize('slowest', [0.93, 1.0])
def test_a_lidar_whose_speed_drifts_keeps_its_nod_and_coverage(slowest):
    """An LD19 measures 4500 beams per second, at 9.3 to 10.6 revolutions per second."""
    view = LidarView(NodConfig(steps_per_revolution=450))
    assert view.look(LD19)
    before = view.config, view.task
    for rate in np.linspace(10.0 * slowest, 10.6, 40):
        beams = round(4500.0 / rate)
        end = math.tau * (beams - 1) / beams
        assert not view.look(lidar(beams, 0.0, end, rate, beams))
        assert not view.look(lidar(beams, end, 0.0, rate, beams))
    assert (view.config, view.task) == before
    assert view.look(RPLIDAR)
    assert view.config.steps_per_revolution == 719


def scans(geometry, nod_at, count):
    """Yield scans of a wall on every side, with the pitch of a nod."""
    beams = Beams(geometry, REFERENCE_LASER_POSE)
    period = geometry.time_increment * math.tau / geometry.angle_increment
    for k in range(count):
        stamp_ns = START_NS + round(k * period * S)
        ranges = np.full(geometry.beams, 2.0, np.float32)
        scan = Scan(stamp_ns, geometry, ranges)
        yield scan, beams, nod_at(scan, beams)


@of_every_lidar
def test_coverage_is_that_of_plain_counting_with_the_beams_of_the_lidar(geometry):
    """Cells are counted from the angles of the message, without the task's own functions."""
    config = config_for(geometry)
    monitor, controller = CoverageMonitor(config), NodController(config)

    def pitch_of(scan, beams):
        controller.add_scan(scan.geometry, scan.stamp_ns)
        return controller.command[0].pitch(scan.stamp_ns + beams.offset_ns)

    hit, count = set(), 0
    cell = 2.0 * math.asin(0.05)
    for scan, beams, pitch in scans(geometry, pitch_of, 12):
        monitor.add(assembled_of(scan, beams, pitch))
        since = geometry.angle_increment * (np.arange(geometry.beams) % round(
            math.tau / geometry.angle_increment
        ))  # fmt: skip
        column = np.floor(since / cell + 1e-4)
        row = np.floor((pitch - config.pitch_min) / cell + 1e-9)
        hit |= set(zip(column.astype(int), row.astype(int), strict=True))
        count += geometry.beams
    covered = monitor.covered()
    assert covered.beams == count
    width = math.tau if geometry in (LD19, RPLIDAR) else since[-1]
    columns, rows = math.ceil(width / cell - 1e-4), math.ceil(1.2272 / cell)
    assert covered.cells == columns * rows
    assert covered.seen == pytest.approx(len(hit) / covered.cells, abs=2.0 / covered.cells)
    even = nod_for(config, geometry).steps_per_revolution % 2 == 0
    assert covered.repeats <= (12 / count if even else 0.01)


@of_every_lidar
@pytest.mark.parametrize('steps', ['its own', 'of the URG-04LX'])
@pytest.mark.parametrize('mode', ['feedback', 'interlaced'])
def test_sweep_by_sweep_all_cells_are_seen_in_rounds(geometry, steps, mode):
    """The servo is on the nod exactly, so a round is not longer than with random beams."""
    config = AssemblerConfig(object_size=0.2, nod_mode=mode, samples_per_sweep=7547)
    if steps == 'its own':
        config = replace(config_for(geometry), nod_mode=mode)
    controller, commands, rounds = NodController(config), [], set()

    def pitch_of(scan, beams):
        controller.add_scan(scan.geometry, scan.stamp_ns)
        times_ns = scan.stamp_ns + beams.offset_ns
        pitch = controller.command[0].pitch(times_ns)
        for start_ns, nod in commands:
            pitch = np.where(times_ns >= start_ns, nod.pitch(times_ns), pitch)
        return pitch

    period = geometry.time_increment * math.tau / geometry.angle_increment
    for scan, beams, pitch in scans(geometry, pitch_of, round(12.0 / period)):
        now_ns = int(scan.stamp_ns + beams.offset_ns[-1]) + 5_000_000
        if controller.add_beams(scan.stamp_ns, beams, pitch, now_ns):
            commands = [*commands[-4:], controller.command[::-1]]
            span = commands[-1][1].pitch_max - commands[-1][1].pitch_min
            assert span / commands[-1][1].sweep_duration <= 6.0 * 1.001
        rounds.add(controller.round_time)
    taken = [time for time in rounds if math.isfinite(time)]
    rows, cells = math.ceil(1.2272 / 0.1), math.ceil(math.tau / 0.1) * math.ceil(1.2272 / 0.1)
    assert taken
    assert max(taken) < max(rows * math.log(cells) * period, 2.0)
