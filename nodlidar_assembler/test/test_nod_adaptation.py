"""The nod on the way to a wall: evenly spaced rows, a speed the servo holds, no common divisor."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_assembler.nod_adaptation import NodAdaptation, samples_needed
from nodlidar_assembler.pitch_limits import PitchLimits, PitchLimitsConfig
from nodlidar_common.errors import ParameterError
import numpy as np
import pytest

S = 1_000_000_000
START_NS = 1_700_000_000 * S
BEAM = 0.1 / 1024
WIDE = PitchLimitsConfig(pitch_min=-1.2, pitch_max=1.2)


@given(
    st.floats(0.05, 2.4),
    st.integers(1, 8000),
    st.floats(0.5, 6.0),
    st.sampled_from([1024, 1440, 400, 1]),
)
def test_it_is_the_least_coprime_n_s_that_is_slow_enough(span, planned, fastest, n_l):
    n_s = samples_needed(span, planned, fastest, BEAM, n_l)
    first = max(planned, math.ceil(span / (fastest * BEAM)))
    fitting = (n for n in range(first, first + 2 * n_l) if math.gcd(n, n_l) == 1)
    assert n_s == next(fitting)
    assert span / (n_s * BEAM) <= fastest * (1.0 + 1e-12)


def approach(adaptation, ranges):
    """Return the shapes while the range is seen to change, one scan every 0.1 s."""
    shapes = []
    for k, distance in enumerate(ranges):
        now_ns = START_NS + k * S // 10
        adaptation.limits.update(now_ns, np.full(50, distance))
        shapes.append(adaptation.shape(now_ns, BEAM))
    return shapes


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(0.1, 6.0), min_size=1, max_size=60), st.integers(1001, 8000))
def test_every_shape_is_coprime_and_slow_enough(ranges, planned):
    for shape in approach(NodAdaptation(PitchLimits(WIDE), planned, 4.0, 1024), ranges):
        assert math.gcd(shape.samples_per_sweep, 1024) == 1
        assert shape.samples_per_sweep >= planned
        span = shape.pitch_max - shape.pitch_min
        assert span / (shape.samples_per_sweep * BEAM) <= 4.0 * (1.0 + 1e-12)


def test_rows_on_the_wall_stay_as_far_apart_while_the_servo_can():
    """Of 1.9 m of height every traverse sees 4001 rows; with fixed limits they would bunch."""
    distance = np.linspace(4.0, 1.2, 120)
    shapes = approach(NodAdaptation(PitchLimits(WIDE), 4001, 6.0, 1024), distance)[20:]
    heights = np.array(
        [
            d * (math.tan(shape.pitch_max) - math.tan(shape.pitch_min)) / shape.samples_per_sweep
            for d, shape in zip(distance[20:], shapes, strict=True)
        ]
    )
    assert {shape.samples_per_sweep for shape in shapes} == {4001}
    # Without odometry the range lags by half a window, 0.19 m of 1.2 m, and the hysteresis is 5 %.
    np.testing.assert_allclose(heights, 1.9 / 4001, rtol=0.2)


def test_n_s_does_not_hunt_when_the_range_wavers():
    rng = np.random.default_rng(1)
    adaptation = NodAdaptation(PitchLimits(WIDE), 2001, 3.0, 1024)
    approach(adaptation, [0.9] * 40)
    later = START_NS + 40 * S // 10
    seen = set()
    for k, distance in enumerate(rng.uniform(0.85, 0.95, 300)):
        now_ns = later + k * S // 10
        adaptation.limits.update(now_ns, np.full(50, distance))
        seen.add(adaptation.shape(now_ns, BEAM).samples_per_sweep)
    assert len(seen) == 1


def test_it_returns_to_the_planned_n_s():
    adaptation = NodAdaptation(PitchLimits(WIDE), 4001, 3.0, 1024)
    shapes = approach(adaptation, [0.5] * 40 + [3.0] * 40)
    assert shapes[39].samples_per_sweep > 6000
    assert shapes[-1].samples_per_sweep == 4001


def test_an_even_plan_is_made_coprime():
    [shape] = approach(NodAdaptation(PitchLimits(WIDE), 8000, 6.0, 1024), [2.0])
    assert shape.samples_per_sweep == 8001


@pytest.mark.parametrize(
    ('key', 'arguments'),
    [
        ('samples_per_sweep', (0, 3.0, 1024)),
        ('fastest', (4001, 0.0, 1024)),
        ('fastest', (4001, math.nan, 1024)),
        ('steps_per_revolution', (4001, 3.0, 0)),
    ],
)
def test_what_makes_no_nod_is_named(key, arguments):
    with pytest.raises(ParameterError, match=f"'{key}'"):
        NodAdaptation(PitchLimits(WIDE), *arguments)
