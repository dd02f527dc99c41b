import math
import struct

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_servo.models.control_table import signed, TABLE_1
from nodlidar_servo.models.models import MODELS, PitchScale
import pytest

RX24F = MODELS['RX-24F']


def test_units_of_the_rx24f_are_those_of_its_control_table():
    assert RX24F.number == 24
    assert RX24F.tick_angle == pytest.approx(0.00511, abs=5e-6)
    assert RX24F.speed_unit == pytest.approx(0.01162, abs=5e-6)
    assert RX24F.max_speed == pytest.approx(126 * 2 * math.pi / 60)


def test_zero_tick_is_level():
    assert PitchScale(RX24F, 512, False).pitch(512) == 0.0
    assert PitchScale(RX24F, 512, False).tick(0.0) == 512


def test_rising_ticks_lift_the_beam_unless_inverted():
    assert PitchScale(RX24F, 512, False).pitch(612) == pytest.approx(100 * RX24F.tick_angle)
    assert PitchScale(RX24F, 512, True).pitch(612) == pytest.approx(-100 * RX24F.tick_angle)


@given(st.sampled_from(sorted(MODELS)), st.integers(0, 4095), st.booleans(), st.integers(0, 4095))
def test_ticks_survive_the_way_to_pitch_and_back(name, zero_tick, invert, tick):
    scale = PitchScale(MODELS[name], zero_tick, invert)
    assert scale.tick(scale.pitch(tick)) == tick


def test_pitch_range_is_ascending_also_when_inverted():
    low, high = PitchScale(RX24F, 512, True).pitch_range
    assert low == pytest.approx(-511 * RX24F.tick_angle)
    assert high == pytest.approx(512 * RX24F.tick_angle)


@given(st.floats(0.0, 100.0))
def test_a_speed_is_never_sent_as_uncontrolled(speed):
    counts = RX24F.speed_counts(speed)
    assert 1 <= counts <= 1023
    if RX24F.speed_unit <= speed <= 1023 * RX24F.speed_unit:
        assert abs(counts * RX24F.speed_unit - speed) <= RX24F.speed_unit / 2 + 1e-12


@pytest.mark.parametrize(
    ('register', 'value'), [(0, 0), (5, 5), (0x400, 0), (0x405, -5), (0x3FF, 1023), (0x7FF, -1023)]
)
def test_bit_10_means_falling_ticks(register, value):
    assert signed(register) == value
    present = TABLE_1.parse_present(struct.pack('<HHHBB', 512, register, register, 120, 35))
    assert (present.speed, present.load) == (value, value)
