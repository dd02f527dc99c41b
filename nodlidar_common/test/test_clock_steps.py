"""Steps of a clock against one that goes on evenly."""

from nodlidar_common.clock_steps import ClockSteps
import pytest

MS, S = 1_000_000, 1_000_000_000
BEGIN = 1_700_000_000 * S


@pytest.mark.parametrize(
    'step_ns', [-3600 * S, -25 * S, -20 * MS, -2 * MS, 2 * MS, 50 * MS, 3 * S]
)
def test_a_step_is_told_once_with_its_size(step_ns):
    steps = ClockSteps()
    times_ns = [k * 10 * MS for k in range(10)]
    told = [steps.step_ns(BEGIN + t + (t >= 50 * MS) * step_ns, t) for t in times_ns]
    assert told == [0] * 5 + [step_ns] + [0] * 4


@pytest.mark.parametrize('rate', [-5e-4, 5e-4])
def test_a_clock_that_is_corrected_slowly_makes_no_step(rate):
    steps = ClockSteps()
    assert not any(steps.step_ns(BEGIN + round(k * S * (1 + rate)), k * S) for k in range(3600))


def test_a_pause_between_two_readings_is_no_step():
    steps = ClockSteps()
    assert [steps.step_ns(BEGIN + t * S, t * S) for t in (0, 5, 3605)] == [0, 0, 0]
