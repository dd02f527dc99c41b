"""Regions: what is refused and why, how they are scanned, against an ideal servo, and the end."""

from dataclasses import replace
import math
import time

from assembling import assembled_of
from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_LASER_POSE, ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.lidar_view import task_for
from nodlidar_assembler.control.nod_controller import NodController
from nodlidar_assembler.control.region_plan import Region, region_plan
from nodlidar_assembler.control.region_scan import RegionScan
from nodlidar_common.errors import ParameterError
import numpy as np
import pytest

S = 1_000_000_000
BEGIN_NS = 1_700_000_000 * S
PERIOD_NS = S // 10
STEP = math.tau / 1024
URG = ScanGeometry(682, -340 * STEP, STEP, 0.1 / 1024, 0.02, 5.6)
AROUND = ScanGeometry(1024, -math.pi, STEP, 0.1 / 1024, 0.02, 5.6)
BEAMS = Beams(URG, REFERENCE_LASER_POSE)
CONFIG = AssemblerConfig()
VIEW = task_for(CONFIG, URG)
LIMITS = -0.8, 0.8


def plan_of(region, view=VIEW):
    return region_plan(region, CONFIG, view, LIMITS)


@pytest.mark.parametrize('half', [0.2505, 0.4005, 0.601])
def test_a_region_straight_behind_has_as_many_cells_as_one_ahead(half):
    """The last column, narrower than a step, is left out: that moves the centre beyond -pi."""
    view = task_for(CONFIG, AROUND)
    ahead, behind = (
        plan_of(Region(azimuth_min=centre - half, azimuth_max=centre + half, cell=0.1), view)
        for centre in (0.0, math.pi)
    )
    assert behind.task.cells == ahead.task.cells


@pytest.mark.parametrize(
    ('fields', 'key', 'reason'),
    [
        ({'pitch_min': -0.9, 'pitch_max': 0.1}, 'pitch_min', '0.8 rad, the limits of the mount'),
        ({'pitch_min': 0.1, 'pitch_max': 0.9}, 'pitch_max', 'the limits of the mount'),
        ({'pitch_min': 0.2, 'pitch_max': 0.1}, 'pitch_max', 'above pitch_min'),
        ({'pitch_max': 1e-300}, 'pitch_max', 'above pitch_min by at least 0.006136 rad'),
        ({'azimuth_min': 0.5, 'azimuth_max': 0.1}, 'azimuth_max', 'above azimuth_min'),
        ({'azimuth_max': 0.006}, 'azimuth_max', 'above azimuth_min by at least 0.006136 rad'),
        ({'azimuth_min': -3.0, 'azimuth_max': 0.1}, 'azimuth_min', 'in the view of the lidar'),
        ({'azimuth_min': 1.0, 'azimuth_max': 2.5}, 'azimuth_max', 'in the view of the lidar'),
        ({'object_size': 0.01, 'object_distance': 2.0}, 'object_size', 'a step of the lidar'),
        ({'object_size': 0.5, 'object_distance': 0.1}, 'object_size', 'at most twice'),
        ({'cell': 0.005}, 'cell', 'at least 0.006136 rad'),
        ({'cell': 1e-6}, 'cell', 'at least 0.006136 rad'),
        ({'cell': 3.0}, 'cell', 'at most 1 rad'),
        ({'cell': -0.1}, 'cell', 'at least 0'),
        ({'time_limit': 601.0}, 'time_limit', 'at most 600 s'),
        ({'object_distance': math.nan}, 'object_distance', 'finite'),
        ({'object_distance': 1e30}, 'object_distance', 'between 0.001 and'),
        ({'pitch_max': math.inf}, 'pitch_max', 'finite'),
    ],
)
def test_what_cannot_be_scanned_is_refused_with_the_reason(fields, key, reason):
    with pytest.raises(ParameterError, match=reason) as caught:
        plan_of(Region(**fields))
    assert caught.value.key == key


def test_a_region_of_one_step_is_seen_within_seconds():
    plan = plan_of(Region(0.0, STEP, -STEP, STEP, cell=0.1))
    assert plan.runs.max() < 10.0


def test_zeros_are_the_values_of_the_parameters():
    task = plan_of(Region()).task
    assert (task.pitch_min, task.pitch_max) == (CONFIG.pitch_min, CONFIG.pitch_max)
    assert 2.0 * task.azimuth == pytest.approx(681 * STEP, abs=STEP)
    asked = 2.0 * math.asin(CONFIG.object_size / (2.0 * CONFIG.object_distance))
    assert task.cell <= asked
    assert task.rows == math.ceil(task.span / asked)


def test_a_plan_hardly_delays_a_command_however_small_the_object():
    begin = time.process_time()
    plan = plan_of(Region(-0.78, 0.78, cell=0.0063))
    assert time.process_time() - begin < 0.3
    assert plan.task.cells > 150_000
    assert plan.runs[0] <= plan.sweep


def test_a_finer_lidar_has_an_end_to_its_cells_too():
    step = math.tau / 4096
    config = replace(CONFIG, steps_per_revolution=4096)
    view = task_for(config, ScanGeometry(4096, -math.pi, step, 0.1 / 4096, 0.02, 30.0))
    with pytest.raises(ParameterError, match='at most 400000 cells') as caught:
        region_plan(Region(cell=0.002), config, view, LIMITS)
    assert caught.value.key == 'cell'
    plan = region_plan(Region(cell=0.1), config, view, LIMITS)
    assert RegionScan(plan, BEGIN_NS, BEGIN_NS).covered.seen == 0.0


def region_from(low, span, right, width, cell):
    return Region(low, min(low + span, 0.79), right, min(right + width, 2.08), cell=cell)


regions = st.builds(
    region_from,
    st.floats(-0.78, 0.6),
    st.floats(0.1, 1.4),
    st.floats(-2.07, 1.8),
    st.floats(0.05, 4.1),
    st.floats(0.02, 0.3),
)


@settings(max_examples=30)
@given(regions)
def test_every_column_of_a_plan_has_a_beam_and_its_nod_is_within_the_mount(region):
    plan = plan_of(region)
    task, shape = plan.task, plan.shape
    columns = task.column_of_step()
    assert set(range(task.columns)) <= set(columns.tolist())
    assert LIMITS[0] <= shape.pitch_min <= region.pitch_min
    assert region.pitch_max <= shape.pitch_max <= LIMITS[1]
    assert math.gcd(shape.samples_per_sweep, 1024) == 1
    # No part of the region that is as large as a step is left out.
    assert task.centre - task.azimuth == pytest.approx(region.azimuth_min, abs=1e-9)
    assert region.azimuth_max - task.centre - task.azimuth <= STEP + 1e-9
    # The bound: one row of a column in each revolution.
    assert plan.runs[0] >= (task.rows - 1) / task.scan_rate


def follow(region, begin_ns=BEGIN_NS, mode='coprime', view=URG, revolutions=2000):
    """Scan a region with a servo that is exactly on every command in effect; return all of it."""
    beams = Beams(view, REFERENCE_LASER_POSE)
    config = replace(CONFIG, nod_mode=mode)
    controller, scan = NodController(config), None
    commands = []
    for number in range(revolutions):
        stamp_ns = begin_ns + number * PERIOD_NS
        controller.add_scan(view, stamp_ns)
        commands.append(controller.command)
        times_ns = stamp_ns + beams.offset_ns
        pitch = pitch_of(commands, times_ns)
        now_ns = int(times_ns[-1]) + 20_000_000
        ranges = np.full(view.beams, 2.0, dtype=np.float32)
        assembled = assembled_of(Scan(stamp_ns, view, ranges), beams, pitch)
        controller.add_beams(stamp_ns, beams, pitch, now_ns)
        commands.append(controller.command)
        if number == 30:
            plan = region_plan(region, controller.view.config, controller.view.task, LIMITS)
            scan = RegionScan(plan, now_ns, controller.take_over(plan.shape, now_ns))
            commands.append(controller.command)
        elif scan is not None:
            scan.add(assembled)
            scan.check(now_ns)
            if scan.is_over:
                break
    return controller, scan, now_ns


def pitch_of(commands, times_ns):
    """Return the pitch by the last two commands: the last one may begin later."""
    nod, start_ns = commands[-1]
    former = next((n for n, _ in reversed(commands) if n is not nod), nod)
    return np.where(times_ns < start_ns, former.pitch(times_ns), nod.pitch(times_ns))


@settings(max_examples=15)
@given(regions, st.sampled_from(['coprime', 'feedback', 'interlaced']), st.integers(0, S))
def test_a_region_is_seen_in_the_predicted_time_in_any_mode(region, mode, later_ns):
    controller, scan, _ = follow(region, BEGIN_NS + later_ns, mode)
    assert scan.success
    assert scan.covered.seen == 1.0
    assert scan.covered.hole == 0.0
    # A scan ends up to a revolution after the last beam that was needed.
    assert scan.duration <= 1.1 * scan.predicted_time + 0.1
    # A few rows may be seen on the way to the region.
    rows = (region.pitch_max - region.pitch_min) / region.cell
    assert rows < 10 or scan.duration >= 0.9 * scan.predicted_time - 0.4
    assert controller.taken_over


def test_the_nod_is_given_back_as_it_was():
    controller, _, now_ns = follow(Region(0.1, 0.5, cell=0.1))
    assert (controller.shape.pitch_min, controller.shape.pitch_max) == (0.05, 0.55)
    assert not controller.change(controller.planned, now_ns)  # not before it is given back
    controller.give_back(now_ns)
    assert controller.shape == controller.planned
    assert not controller.taken_over
    nod, start_ns = controller.command
    assert (nod.pitch_min, nod.pitch_max) == (CONFIG.pitch_min, CONFIG.pitch_max)
    assert start_ns == 0
    controller.give_back(now_ns)  # once is enough


def test_another_plan_counts_when_the_nod_is_given_back():
    controller, _, now_ns = follow(Region(0.1, 0.5, cell=0.1))
    controller.reconfigure(replace(CONFIG, pitch_min=-0.3, samples_per_sweep=4001), now_ns)
    assert (controller.taken_over, controller.shape.pitch_min) == (True, 0.05)
    controller.give_back(now_ns)
    nod, _ = controller.command
    assert (nod.pitch_min, nod.samples_per_sweep) == (-0.3, 4001)


def test_the_points_are_those_of_the_region_since_the_start():
    region = Region(-0.2, 0.3, -0.5, 1.0, cell=0.05)
    _, scan, _ = follow(region)
    points = scan.points
    x, y, z = points.xyz.T
    # Ranges are 2 m from the optical centre, 80 mm above the axis in the nodding frame.
    azimuth = np.arcsin(y / 2.0)
    pitch = np.arctan2(z, x) - np.arctan2(0.08, 2.0 * np.cos(azimuth))
    assert pitch.min() >= -0.2 - 1e-6
    assert pitch.max() <= 0.3 + 1e-6
    assert azimuth.min() >= -0.5 - 1e-6
    assert azimuth.max() <= 1.0 + 1e-6
    assert len(points.data) == scan.covered.beams


def test_of_a_scan_during_which_it_starts_the_later_beams_count():
    start_ns = BEGIN_NS + PERIOD_NS // 3
    scan = RegionScan(plan_of(Region(cell=0.05)), start_ns, start_ns)
    ranges = np.full(URG.beams, 2.0, dtype=np.float32)
    pitch = np.zeros(URG.beams)
    scan.add(assembled_of(Scan(BEGIN_NS, URG, ranges), BEAMS, pitch))
    times_ns = BEGIN_NS + BEAMS.offset_ns
    inside = scan._columns[scan._task.step_at(BEAMS.azimuth)] >= 0
    assert 0 < len(scan.points.data) == np.sum(inside & (times_ns >= start_ns)) < inside.sum()


def test_it_ends_at_its_time_limit_with_what_was_seen():
    _, scan, now_ns = follow(replace(Region(-0.5, 0.5, cell=0.05), time_limit=1.0))
    assert scan.is_over
    assert not scan.success
    assert 'time limit of 1.0 s was over' in scan.message
    assert 0.1 < scan.covered.seen < 0.9
    assert scan.progress(now_ns).largest_hole > 0.05
    assert len(scan.points.data) > 0


@pytest.mark.parametrize('cancelled', [False, True])
def test_its_duration_is_until_its_end_also_where_no_more_scans_came(cancelled):
    scan = RegionScan(plan_of(replace(Region(), time_limit=5.0)), BEGIN_NS, BEGIN_NS)
    ranges = np.full(URG.beams, 2.0, dtype=np.float32)
    scan.add(assembled_of(Scan(BEGIN_NS, URG, ranges), BEAMS, np.zeros(URG.beams)))
    assert scan.duration < 0.1
    if cancelled:
        scan.end('cancelled', BEGIN_NS + 4 * S)
    for now in (5, 6):
        scan.check(BEGIN_NS + now * S)
    assert scan.duration == (4.0 if cancelled else 6.0)
    if not cancelled:
        assert scan.message.endswith('was over; no scan of the last 5.9 s was placed')


def test_it_ends_when_no_scan_is_placed_any_more():
    scan = RegionScan(plan_of(replace(Region(), time_limit=600.0)), BEGIN_NS, BEGIN_NS)
    for now in (1, 9):
        scan.check(BEGIN_NS + now * S)
        assert not scan.is_over
    scan.check(BEGIN_NS + 11 * S)
    assert scan.message == 'no scan of the last 11.0 s was placed'


@pytest.mark.parametrize(('back', 'ends'), [(1, False), (2, True), (1_000_000, True)])
def test_it_ends_when_time_goes_back_to_before_its_start(back, ends):
    """As in a simulation that is reset: its scans and the begin of its nod are far ahead then."""
    scan = RegionScan(plan_of(Region()), BEGIN_NS, BEGIN_NS + S // 2)
    scan.check(BEGIN_NS - back * S)
    assert scan.is_over == ends
    assert scan.message == ('the clock was set' if ends else '')
    assert scan.duration == 0.0
    assert not scan.success


def test_feedback_counts_down_to_the_end():
    plan = plan_of(Region())
    scan = RegionScan(plan, BEGIN_NS, BEGIN_NS + S // 2)
    assert scan.predicted_time == pytest.approx(0.5 + np.median(plan.runs), abs=0.1)
    to_go = [scan.progress(BEGIN_NS + k * S // 10).time_to_go for k in range(200)]
    assert to_go[0] == pytest.approx(scan.predicted_time)
    assert to_go[10] == pytest.approx(to_go[0] - 1.0)
    # What was missed is passed again in the sweep after.
    late = math.ceil(scan.predicted_time * 10) + 5
    sweep = plan.shape.samples_per_sweep * 0.1 / 1024
    assert to_go[late] == pytest.approx(scan.predicted_time + sweep - late / 10, abs=0.1)
    almost = round((scan.time_limit - 0.1) * S)
    assert scan.progress(BEGIN_NS + almost).time_to_go <= 0.1 + 1e-9
    assert scan.progress(BEGIN_NS).seen == 0.0
    assert (scan.progress(BEGIN_NS + 1000 * S).time_to_go, scan.is_over) == (0.0, False)


def test_points_that_the_cloud_lacks_are_named():
    """As after odometry has jumped, 0.4 s from the start."""
    scan = RegionScan(plan_of(Region()), BEGIN_NS, BEGIN_NS)
    ranges = np.full(URG.beams, 2.0, dtype=np.float32)
    for k in range(8):
        made = assembled_of(
            Scan(BEGIN_NS + k * PERIOD_NS, URG, ranges), BEAMS, np.zeros(URG.beams)
        )
        scan.add(replace(made, jumped=k == 4))
    scan.end('cancelled', BEGIN_NS + S)
    last_beam = 3 * 0.1 + 681 * 0.1 / 1024
    assert scan.message == f'cancelled; the cloud lacks the points of the first {last_beam:.1f} s'
    assert scan.points.time_ns[0] >= BEGIN_NS + 4 * PERIOD_NS


def test_scans_that_come_twice_or_late_count_once():
    plan = plan_of(Region())
    scan = RegionScan(plan, BEGIN_NS, BEGIN_NS)
    pitch = np.zeros(URG.beams)
    ranges = np.full(URG.beams, 2.0, dtype=np.float32)
    for stamp_ns in (BEGIN_NS + PERIOD_NS, BEGIN_NS + PERIOD_NS, BEGIN_NS):
        made = Scan(stamp_ns, URG, ranges)
        scan.add(assembled_of(made, BEAMS, pitch))
    # All but the last beam, which alone would not be a cell wide.
    assert len(scan.points.data) == scan.covered.beams == URG.beams - 1


def test_another_lidar_ends_the_takeover():
    controller, _, now_ns = follow(Region(time_limit=0.5))
    assert controller.taken_over
    controller.add_scan(AROUND, now_ns + PERIOD_NS)
    assert not controller.taken_over
    assert controller.shape == controller.planned


def test_a_lidar_that_sees_all_around_scans_regions_behind_it():
    region = Region(-0.2, 0.2, 2.5, 4.0, cell=0.06)
    _, scan, _ = follow(region, view=AROUND)
    assert scan.success
    x = scan.points.data['x']
    assert x.max() < 0.0
    _, scan, _ = follow(Region(cell=0.1), view=AROUND)
    assert scan.success
    assert scan.covered.cells >= math.tau / 0.1 * 12


def test_before_the_first_scan_nothing_is_taken_over():
    with pytest.raises(ParameterError, match='before the nod can be taken over'):
        NodController(CONFIG).take_over(plan_of(Region()).shape, BEGIN_NS)
