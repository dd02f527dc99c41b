"""An offset of the joint is told from its lateness."""

from dataclasses import dataclass

from nodlidar_common.nod import Nod
from nodlidar_servo.joint_trajectory.nod_offset import NodOffset
import pytest

S = 10**9
T0 = 1_763_900_000 * S


@dataclass(frozen=True)
class Sample:
    stamp_ns: int
    pitch: float


def measured(offset, late, seconds=8.0, rate=100):
    """Return the offset of a joint that follows a triangle, so late [s] and so far above it."""
    nod, found = Nod(-0.6, 0.6, 0.74, 7547, T0), NodOffset()
    for k in range(round(seconds * rate)):
        now = T0 + S + k * S // rate
        pitch = float(nod.pitch(now - round(late * S))) + offset
        found.add(nod, Sample(now, pitch), nod.speed)
    return found


@pytest.mark.parametrize('late', [-0.04, 0.0, 0.05])
@pytest.mark.parametrize('offset', [-0.15, -0.07, 0.07, 0.15])
def test_an_offset_is_measured_whatever_the_lateness(offset, late):
    assert measured(offset, late).radians == pytest.approx(offset, abs=0.005)


@pytest.mark.parametrize('late', [-0.1, 0.0, 0.05, 0.12])
@pytest.mark.parametrize('offset', [-0.03, 0.0, 0.03])
def test_a_joint_that_is_late_or_bent_a_little_has_no_offset(offset, late):
    assert measured(offset, late).radians == 0.0


def test_it_takes_some_legs_and_begins_anew_when_the_joint_leaves_the_nod():
    assert measured(0.15, 0.0, seconds=0.7).radians == 0.0
    found = measured(0.15, 0.0)
    nod = Nod(-0.6, 0.6, 0.74, 7547, T0)
    found.add(nod, Sample(T0 + round(0.37 * S), 0.55), nod.speed)  # it should be at 0
    assert found.radians == 0.0
