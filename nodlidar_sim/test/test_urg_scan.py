from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common import scip
from nodlidar_sim.devices.urg_scan import clustered, range_codes, Revolution, ScanRequest
import numpy as np
import pytest

REVOLUTION_NS = 100_000_000
STEP_NS = REVOLUTION_NS / 1024


class Recorder:
    """Measures 1 m everywhere and remembers when and where."""

    def __call__(self, times_ns, azimuth):
        self.times_ns, self.azimuth = times_ns, azimuth
        return np.ones(len(times_ns))


@pytest.mark.parametrize(
    ('metres', 'code'),
    [
        (0.020, 20),
        (1.2344, 1234),
        (1.2346, 1235),
        (5.6, 5600),
        (5.601, 0),
        (np.inf, 0),
        (0.019, 19),
        (0.0, 19),
        (np.nan, 7),
    ],
)
def test_range_codes(metres, code):
    assert range_codes(np.array([metres])).tolist() == [code]


@given(st.lists(st.sampled_from([0, 1, 7, 19, 20, 21, 300, 5600]), min_size=1), st.integers(0, 99))
def test_clusters_are_the_least_valid_range_of_each_group(codes, size):
    step = max(size, 1)
    groups = [codes[i : i + step] for i in range(0, len(codes), step)]
    expected = [min([c for c in group if c >= 20], default=group[0]) for group in groups]
    assert clustered(np.array(codes), size).tolist() == expected


def test_every_beam_is_measured_at_its_own_instant():
    measure, revolution = Recorder(), Revolution(1000, 1000 + REVOLUTION_NS, 0)
    revolution.measure(measure)
    steps = np.arange(44, 726)
    assert measure.times_ns.tolist() == [1000 + round(k * STEP_NS) for k in steps.tolist()]
    assert revolution.last_beam_ns == measure.times_ns[-1]
    np.testing.assert_allclose(measure.azimuth, (steps - 384) * 2 * np.pi / 1024, atol=1e-15)
    assert measure.azimuth[0] == pytest.approx(-2.08621, abs=1e-5)
    assert measure.azimuth[-1] == pytest.approx(2.09235, abs=1e-5)


def test_steps_outside_the_measured_range_are_not_measurable():
    revolution = Revolution(0, REVOLUTION_NS, 0)
    revolution.measure(Recorder())
    assert set(revolution.codes[:44]) == set(revolution.codes[726:]) == {19}
    assert set(revolution.codes[44:726]) == {1000}
    assert len(revolution.codes) == 769


def test_short_values_are_clipped():
    revolution = Revolution(0, REVOLUTION_NS, 0)
    revolution.codes[100:103] = [4094, 4095, 5600]
    data = scip.join_blocks(ScanRequest(100, 102, 1, 2).lines(revolution)[1:])
    assert scip.decode(data, 2).tolist() == [4094, 4095, 4095]
