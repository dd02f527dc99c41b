"""A joint that does not follow the commanded nod is named."""

from nodlidar_assembler.plausibility.nod_following import NodFollowing
from nodlidar_common.nod import Nod
import pytest

MS = 1_000_000
NOD = Nod(-0.5, 0.5, 1.0, 10240, 0)


def watched(pitch, seconds=9.0, period_ms=10, nod=NOD):
    following = NodFollowing()
    for ms in range(0, round(seconds * 1000), period_ms):
        following.add(ms * MS, pitch(ms * MS), nod)
    return following


def test_a_joint_that_nods_is_not_named_wherever_it_is_in_the_nod():
    for late_ms in range(0, 2000, 100):
        assert not watched(lambda ns, late=late_ms: float(NOD.pitch(ns + late * MS))).warning


@pytest.mark.parametrize('pitch', [0.0, 0.3, -0.5])
def test_a_joint_that_stands_still_is_named_after_two_nods_up_and_down(pitch):
    assert not watched(lambda ns: pitch, 4.0).warning
    assert watched(lambda ns: pitch, 4.1).warning == (
        'the joint moves by 0.00 rad, although a nod is commanded'
    )


def test_a_joint_that_moves_a_little_is_named_with_how_far():
    assert '0.40 rad' in watched(lambda ns: 0.4 * float(NOD.pitch(ns))).warning
    assert not watched(lambda ns: 0.6 * float(NOD.pitch(ns))).warning


@pytest.mark.parametrize(
    ('scale', 'zero', 'reached'),
    [(57.3, 0.0, '-28.65 to 28.65'), (1.3, 0.0, '-0.65 to 0.65'), (1.0, 3.14, '2.64 to 3.64')],
)
def test_a_joint_that_goes_beyond_the_nod_is_named_with_where_it_goes(scale, zero, reached):
    """As in degrees, with another gear ratio, or with a zero that is off by half a turn."""
    assert watched(lambda ns: zero + scale * float(NOD.pitch(ns))).warning == (
        f'the joint moves from {reached} rad, although the nod is from -0.50 to 0.50: '
        'check the unit, zero and sign of its positions'
    )


def test_a_joint_on_its_way_to_a_fast_and_narrow_nod_is_not_named():
    narrow = Nod(-0.6, -0.5, 0.1, 1024, 0)
    following = watched(lambda ns: 0.5, 0.5, nod=None)
    for ms in range(500, 9000, 10):
        way = 0.5 - 0.4 * (ms - 500) / 1000
        following.add(ms * MS, max(way, float(narrow.pitch(ms * MS))), narrow)
        assert not following.warning


def test_a_joint_that_overshoots_or_comes_from_elsewhere_is_not_named():
    assert not watched(lambda ns: 1.18 * float(NOD.pitch(ns))).warning
    assert not watched(lambda ns: float(NOD.pitch(ns)) * (2.0 if ns < 1900 * MS else 1.0)).warning
    wide = Nod(-0.8, 0.8, 1.0, 10240, 0)
    following = watched(lambda ns: float(wide.pitch(ns)), 3.3, nod=wide)
    for ms in range(3300, 12000, 10):
        nod = wide if ms < 4700 else NOD
        following.add(ms * MS, float(nod.pitch(ms * MS)), NOD)
        assert not following.warning


def test_without_a_command_or_samples_nobody_knows():
    assert not watched(lambda ns: 0.0, nod=None).warning
    assert not watched(lambda ns: 0.0, period_ms=600).warning


def test_once_it_nods_it_is_no_longer_named():
    following = watched(lambda ns: 0.0)
    for ms in range(9000, 14000, 10):
        following.add(ms * MS, float(NOD.pitch(ms * MS)), NOD)
    assert not following.warning


SLOW = Nod(-0.5, 0.5, 60.0, 614_400, 0)


def test_it_is_no_longer_named_as_soon_as_it_nods_whatever_was_commanded_before():
    following = watched(lambda ns: 0.0, 250.0, nod=SLOW)
    assert following.warning
    for ms in range(250_000, 251_100, 10):
        following.add(ms * MS, float(NOD.pitch(ms * MS)), NOD)
    assert not following.warning


def test_a_joint_that_stops_after_a_slow_nod_is_named_as_soon_as_any():
    following = watched(lambda ns: float(SLOW.pitch(ns)), 30.0, nod=SLOW)
    for ms in range(30_000, 38_100, 10):
        following.add(ms * MS, 0.0, NOD)
    assert following.warning


def test_a_slow_sweep_up_is_awaited_although_the_return_is_fast():
    """A joint that rests during the first 0.9 of each sweep up of an interlaced nod."""
    following, down = NodFollowing(), Nod(-0.5, 0.5, 0.4, 4096, 0)
    up = Nod(-0.5, 0.5, 4.0, 40_960, 0)
    for ms in range(0, 44_000, 10):
        rising = ms % 4400
        pitch = -0.5 if rising < 3600 else 0.5 if rising < 4000 else -0.5
        following.add(ms * MS, pitch, up if rising < 4000 else down)
        assert not following.warning


def test_while_limits_change_the_nod_counts_that_asks_for_the_least():
    following = NodFollowing()
    for ms in range(0, 20000, 10):
        nod = Nod(-0.1 - (ms % 1000) / 2000, 0.1, 1.0, 10240, 0)
        following.add(ms * MS, 0.05 * (ms // 10 % 3), nod)
    assert not following.warning
