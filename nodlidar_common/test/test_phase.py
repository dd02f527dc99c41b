from dataclasses import dataclass, replace

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.nod import Nod
from nodlidar_common.phase import lateness, LOCKED, PhaseDrift, PhaseLead
import numpy as np
import pytest

NOD = Nod(-0.6, 0.4, 0.4, 4001, 1_800_000_000_000_000_000)


@dataclass
class Measured:
    stamp_ns: int
    pitch: float


def measured(sweeps, late=0.0, nod=NOD):
    """Return a sample of a servo that runs on the triangle wave, but late [s]."""
    stamp_ns = nod.reference_time_ns + round(sweeps * nod.sweep_duration * 1e9)
    return Measured(stamp_ns, float(nod.pitch(stamp_ns - round(late * 1e9))))


def fed(late, samples, nod=NOD):
    """Return the lead after samples all over the nod from a servo that takes no lead."""
    lead = PhaseLead()
    for sweeps in np.arange(samples) * 0.0413:
        lead.add(nod, measured(sweeps, late, nod), nod.speed)
    return lead


@given(st.integers(0, 1000), st.floats(-0.24, 0.24), st.floats(-0.09, 0.09))
def test_lateness_is_told_on_both_legs(leg, place, late):
    found = lateness(NOD, measured(leg + 0.5 + place, late), NOD.speed)
    assert found == pytest.approx(late, abs=1e-6)


@given(st.integers(0, 1000), st.floats(-0.24, 0.24), st.floats(1.0, 1.3))
def test_a_servo_that_cruises_faster_than_the_nod_is_not_late(leg, place, ratio):
    sample = measured(leg + 0.5)
    sample.stamp_ns += round(place * NOD.sweep_duration * 1e9)
    direction = 1.0 if leg % 2 == 0 else -1.0
    sample.pitch += direction * place * NOD.span * ratio
    assert lateness(NOD, sample, NOD.speed * ratio) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize('sweeps', [0.0, 0.2, 0.8, 1.1, 1.99])
def test_at_the_turns_nothing_is_told(sweeps):
    assert lateness(NOD, measured(sweeps), NOD.speed) is None


def test_the_nod_is_led_by_what_it_stays_late_but_only_so_far():
    assert fed(0.004, 50).lead_ns == 0
    assert 0 < fed(0.004, 200).lead_ns < fed(0.004, 300).lead_ns
    assert fed(0.004, 10_000).lead_ns == 150_000_000
    assert fed(-0.004, 10_000).lead_ns == -150_000_000
    assert fed(0.004, 200).error == pytest.approx(0.004)


@pytest.mark.parametrize('rate', [20, 100, 1000])
def test_the_lead_changes_by_a_twentieth_of_the_time_at_most(rate):
    lead, leads = PhaseLead(), []
    for index in range(8 * rate):
        lead.add(NOD, measured(index / rate / NOD.sweep_duration, 0.09), NOD.speed)
        leads.append(lead.lead_ns)
    whole = NOD.sweep_duration * rate
    for first in range(int(2 * rate)):
        gained = leads[first + int(whole)] - leads[first]
        assert gained <= 0.05 * NOD.sweep_duration * 1e9 * 1.1 + 0.05 * 1e9 / rate
    assert leads[-1] > 10_000_000


def test_a_servo_that_is_not_on_the_nod_yet_leads_nothing_and_has_no_phase():
    lead = fed(1.5 * LOCKED, 1000, replace(NOD, sweep_duration=1.2))
    assert lead.lead_ns == 0
    assert np.isnan(lead.error)


@pytest.mark.parametrize(('step_ms', 'learns'), [(0.1, True), (40.0, False)])
def test_on_the_way_to_another_nod_no_lead_is_learned_but_to_the_same_one_tuned(step_ms, learns):
    """The servo takes over the nod as it was, and so is late on the other one."""
    lead, before = fed(0.0, 500), fed(0.0, 500).lead_ns
    other = replace(NOD, reference_time_ns=NOD.reference_time_ns + round(step_ms * 1e6))
    for sweeps in 500 * 0.0413 + np.arange(90) * 0.0413:  # some 45 in the middles of legs
        lead.add(other, measured(sweeps, late=0.004), NOD.speed)
    assert (lead.lead_ns > before + 100_000) == learns
    if not learns:
        assert lead.lead_ns == before


@pytest.mark.parametrize(
    ('duration', 'late', 'known'),
    [
        (0.1, 0.02, True),
        (0.1, 0.03, False),  # the middle lasts from 25 ms before to 25 ms after
        (2.0, 0.14, True),
        (2.0, 0.16, False),
    ],
)
def test_a_servo_that_is_too_late_for_its_sweep_has_no_phase(duration, late, known):
    short, lead = replace(NOD, sweep_duration=duration), PhaseLead()
    stamp_ns = short.reference_time_ns + round(0.5 * short.sweep_duration * 1e9)
    pitch = (short.pitch_min + short.pitch_max) / 2.0 - late * short.speed
    lead.add(short, Measured(stamp_ns, pitch), short.speed)
    assert np.isfinite(lead.error) == known


def test_the_error_is_a_mean_of_what_scatters():
    lead = PhaseLead()
    for index in range(200):
        late = 0.004 + (0.003 if index % 2 else -0.003)
        lead.add(NOD, measured(index + 0.5, late), NOD.speed)
    assert lead.error == pytest.approx(0.004, abs=0.0002)


@given(st.floats(-2e-3, 2e-3), st.integers(0, 1000))
def test_samples_per_sweep_are_measured_by_how_the_lateness_grows(rate, seed):
    drift, noise = PhaseDrift(), np.random.default_rng(seed).normal(0.0, 0.002, 1500)
    for index in range(1500):
        seconds = index / 35.0
        drift.add(NOD.reference_time_ns + round(seconds * 1e9), rate * seconds + noise[index])
    assert 4001 * drift.measured_ratio == pytest.approx(4001 * (1.0 + rate), abs=0.15)


def test_samples_per_sweep_are_unknown_at_first_and_after_the_nod_was_left():
    lead = fed(0.001, 100)
    assert np.isnan(lead.drift.measured_ratio)
    for sweeps in np.arange(400) * 0.0413:
        lead.add(NOD, measured(sweeps, 0.001), NOD.speed)
    assert lead.drift.measured_ratio == pytest.approx(1.0, abs=1e-6)
    lead.add(NOD, measured(0.5, 0.12), NOD.speed)
    assert np.isnan(lead.drift.measured_ratio)
