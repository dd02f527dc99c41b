"""Times at their limits: in messages, and turns after an hour (docs/extremes.md)."""

from fractions import Fraction

from builtin_interfaces.msg import Time
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.ros.messages import nod_from_message, nod_to_message, time_message
from nodlidar_common.stamps import time_ns
import numpy as np
import pytest

S = 1_000_000_000
TODAY_NS = 1_700_000_000 * S


@pytest.mark.parametrize(
    ('nanoseconds', 'sec', 'nanosec'),
    [
        (0, 0, 0),
        (1, 0, 1),
        (S - 1, 0, S - 1),
        (S, 1, 0),
        (TODAY_NS - 1, 1_699_999_999, S - 1),
        (TODAY_NS, 1_700_000_000, 0),
        (2**31 * S - 1, 2**31 - 1, S - 1),
        (-1, -1, S - 1),
        (-(2**31) * S, -(2**31), 0),
    ],
)
def test_a_time_comes_and_goes_to_the_nanosecond(nanoseconds, sec, nanosec):
    assert time_message(nanoseconds) == Time(sec=sec, nanosec=nanosec)
    assert time_ns(Time(sec=sec, nanosec=nanosec)) == nanoseconds


@pytest.mark.parametrize('nanoseconds', [2**31 * S, -(2**31) * S - 1, 2**63 - 1])
def test_a_time_that_a_message_cannot_hold_is_refused(nanoseconds):
    with pytest.raises(ParameterError, match="'time' must be from -2147483648 to 2147483647 s"):
        time_message(nanoseconds)


@pytest.mark.parametrize('reference_ns', [0, -1, TODAY_NS - 1, 2**31 * S - 1])
@pytest.mark.parametrize('samples', [1, 2**32 - 1])
def test_a_nod_command_carries_any_reference_time_and_number_of_samples(reference_ns, samples):
    nod = Nod(-0.5, 0.5, 0.4, samples, reference_ns)
    assert nod_from_message(nod_to_message(nod, 0, 'base')) == nod


@pytest.mark.parametrize('samples', [1, 1001, 4001, 10_000_000])
@pytest.mark.parametrize('reference_ns', [0, TODAY_NS - 1, 2**31 * S - 1])
def test_an_hour_of_reversals_is_on_the_nanosecond(samples, reference_ns):
    beam_ns = Fraction(S, 10 * 1024)
    nod = Nod(-0.5, 0.5, float(samples * beam_ns / S), samples, reference_ns)
    last = int(3600 * S / (samples * beam_ns))
    for sweep in (last, last - 1, last // 2, 1):
        exact = reference_ns + sweep * samples * beam_ns
        assert abs(nod.reversal_time_ns(sweep) - exact) <= Fraction(51, 100)
        assert float(nod.sweeps(round(exact))) == pytest.approx(sweep, abs=1e-5, rel=1e-15)


@pytest.mark.parametrize('duration', [1e-9, 1e-4, 0.4, 3600.0, 1e6])
def test_sweeps_of_any_duration_stay_within_the_limits(duration):
    nod = Nod(-0.5, 0.5, duration, 4001, TODAY_NS)
    times_ns = TODAY_NS + np.rint(np.linspace(0.0, 4.0, 4001) * duration * S).astype(np.int64)
    pitch = nod.pitch(times_ns)
    leg = [Fraction(int(t - TODAY_NS)) / (Fraction(duration) * S) % 2 for t in times_ns]
    expected = [float(Fraction(1, 2) - abs(m - 1)) for m in leg]
    np.testing.assert_allclose(pitch, expected, rtol=0, atol=1e-14)
    assert np.all(np.abs(nod.velocity(times_ns)) == 1.0 / duration)
