"""The nod on the way to a wall: an N_s that the servo holds, coprime, sooner done, not hunting."""

from itertools import pairwise
import math
from time import thread_time

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_assembler.control.adapted_shape import AdaptedShape, BAND, candidates, MARGIN
from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_assembler.control.pitch_limits import limits_at, PitchLimits, PitchLimitsConfig
from nodlidar_common.errors import ParameterError
from nodlidar_planner.choice.timing_error import under_error
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np
import pytest

S = 1_000_000_000
START_NS = 1_700_000_000 * S
BEAM = 0.1 / 1024
ERROR = 0.003
DEFAULT = NodConfig().samples_per_sweep
MOUNT = PitchLimitsConfig()
WIDE = PitchLimitsConfig(pitch_min=-1.2, pitch_max=1.2)
STEPS = st.sampled_from([1024, 1440, 400, 1])


@given(st.integers(1, 300_000), st.integers(1, 300_000), STEPS)
def test_all_choices_are_coprime_slow_enough_and_about_the_planned_n_s(planned, fewest, n_l):
    found = candidates(planned, fewest, n_l)
    assert (np.gcd(found, n_l) == 1).all()
    assert found.min() >= fewest
    # Of 48 numbers in a row one is coprime with any of these N_L.
    assert found.min() >= planned / BAND
    assert found.max() <= BAND * max(planned, fewest) + 48
    distance = np.abs(found - max(planned, fewest))
    assert (np.diff(distance) >= 0).all()


def adaptation(config=WIDE, planned=4001, fastest=6.0, n_l=1024):
    nod = NodConfig(
        samples_per_sweep=planned,
        steps_per_revolution=n_l,
        max_nod_speed=fastest,
        timing_error=ERROR,
    )
    return AdaptedShape(PitchLimits(config), nod, nod.task)


def approach(adapting, ranges, start_ns=START_NS, beam_period=BEAM):
    """Return the shapes while the range is seen to change, one scan every 0.1 s."""
    shapes = []
    for k, distance in enumerate(ranges):
        now_ns = start_ns + k * S // 10
        adapting.limits.update(now_ns, np.full(50, distance))
        shapes.append(adapting.shape(now_ns, beam_period))
    return shapes


def changes(shapes):
    """Return how often N_s changes."""
    return sum(a.samples_per_sweep != b.samples_per_sweep for a, b in pairwise(shapes))


@settings(max_examples=30)
@given(st.lists(st.floats(0.02, 6.0), min_size=1, max_size=30), st.integers(1001, 8000), STEPS)
def test_every_shape_is_coprime_and_slow_enough(ranges, planned, n_l):
    beam_period = 0.1 / n_l
    adapting = adaptation(planned=planned, fastest=4.0, n_l=n_l)
    for shape in approach(adapting, ranges, beam_period=beam_period):
        assert math.gcd(shape.samples_per_sweep, n_l) == 1
        span = shape.pitch_max - shape.pitch_min
        assert span / (shape.samples_per_sweep * beam_period) <= 4.0 * (1.0 + 1e-12)


def test_n_s_is_near_the_planned_one_where_the_servo_can():
    for shape in approach(adaptation(), np.linspace(4.0, 1.2, 60)):
        assert 4001 / BAND <= shape.samples_per_sweep <= 4001 * BAND


def test_what_is_chosen_completes_sooner_than_what_is_planned():
    """Median over ranges, hence spans and cells, of the medians of simulated runs."""
    gains = []
    for distance in np.geomspace(0.5, 4.0, 14):
        shape = approach(adaptation(MOUNT, planned=DEFAULT), [distance] * 20)[-1]
        low, high = limits_at(MOUNT, distance)
        assert (shape.pitch_min, shape.pitch_max) == pytest.approx((low, high))
        task = with_whole_rows(min(distance, 2.0), low, high)
        chosen, planned = (
            under_error(task, Pattern(1024, n_s), ERROR, range(10)).median
            for n_s in (shape.samples_per_sweep, DEFAULT)
        )
        gains.append(chosen / planned)
    assert np.median(gains) < 0.8


def with_whole_rows(distance, low, high):
    """Return the task with cells of up to 0.1 m at a distance that divide the span."""
    rows = math.ceil((high - low) / (2.0 * math.asin(0.05 / distance)))
    size = 2.0 * distance * math.sin((high - low) / rows / 2.0)
    task = Task(size, distance, low, high)
    assert task.rows == rows
    return task


def test_n_s_does_not_hunt_when_the_range_wavers():
    rng = np.random.default_rng(1)
    adapting = adaptation(planned=2001, fastest=3.0)
    approach(adapting, [0.9] * 40)
    wavering = rng.uniform(0.85, 0.95, 300)
    assert changes(approach(adapting, wavering, START_NS + 40 * S // 10)) == 0


@pytest.mark.parametrize('swing', [0.04, 0.15])
def test_n_s_does_not_hunt_when_the_range_swings_slowly(swing):
    """From one end to the other it changes by no more than the swing holds margins."""
    ranges = 1.2 * (1.0 + swing * np.sin(np.arange(400) * math.tau / 200))
    most = math.floor(math.log((1.0 + swing) / (1.0 - swing)) / math.log(1.0 + MARGIN))
    assert changes(approach(adaptation(), ranges)[50:]) <= 4 * most


def test_on_the_way_to_other_limits_n_s_changes_once():
    """The limits go for more than a second; N_s is at once the one for where they go."""
    adapting = adaptation()
    approach(adapting, [4.0] * 30)
    shapes = approach(adapting, [0.6] * 40, START_NS + 30 * S // 10)
    assert len({shape.pitch_max for shape in shapes}) > 5
    assert changes(shapes) == 1


def test_where_the_servo_needs_more_the_choice_begins_there_and_comes_back():
    shapes = approach(adaptation(fastest=3.0), [0.5] * 40 + [3.0] * 60)
    wide = shapes[39].pitch_max - shapes[39].pitch_min
    assert 1.0 <= shapes[39].samples_per_sweep * 3.0 * BEAM / wide <= BAND * (1.0 + MARGIN)
    assert shapes[39].samples_per_sweep > 1.5 * 4001
    assert 4001 / BAND <= shapes[-1].samples_per_sweep <= 4001 * BAND


def test_where_no_n_s_ever_completes_the_planned_one_is_kept():
    """A cell of 0.05 rad is narrower than a step of 1/60 revolution."""
    [shape] = approach(adaptation(planned=240, n_l=60), [2.0], beam_period=0.1 / 60)
    assert shape.samples_per_sweep == 241


def test_a_choice_hardly_delays_a_command():
    costs = []
    for distance in np.geomspace(0.3, 4.0, 15):
        adapting = adaptation(MOUNT)
        adapting.limits.update(START_NS, np.full(50, distance))
        begin = thread_time()
        adapting.shape(START_NS, BEAM)
        costs.append(thread_time() - begin)
    assert np.median(costs) < 0.05


@pytest.mark.parametrize(
    ('key', 'value'),
    [
        ('samples_per_sweep', 0),
        ('max_nod_speed', 0.0),
        ('max_nod_speed', math.nan),
        ('max_nod_acceleration', 0.0),
        ('timing_error', -0.001),
    ],
)
def test_what_makes_no_nod_is_named(key, value):
    with pytest.raises(ParameterError, match=f"'{key}'"):
        AdaptedShape(PitchLimits(WIDE), NodConfig(**{key: value}), Task())


@pytest.mark.parametrize('distance', [0.5, 2.0, 4.0, 9.0])
@pytest.mark.parametrize('n_l', [1024, 400])
def test_an_rx_24f_takes_every_sweep_also_of_a_lidar_at_40_hz(distance, n_l):
    """Between narrow limits it is the acceleration that makes a sweep take its time."""
    beam_period = 0.025 / n_l
    shape = approach(adaptation(planned=n_l), [distance] * 20, beam_period=beam_period)[-1]
    span = shape.pitch_max - shape.pitch_min
    peak = min(126.0 / 60.0 * math.tau, math.sqrt(span * 200.0))
    assert shape.samples_per_sweep * beam_period >= span / peak + peak / 200.0
