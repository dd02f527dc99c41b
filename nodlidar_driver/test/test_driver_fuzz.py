"""Whatever bytes come, the driver ends a session by a DeviceError only, and counts what it got."""

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest
from stream_fuzz import DamagedLidar, MUTATIONS, recorded_session, SCANS, TURN_NS, use

NUMBERS = st.integers(0, 255)
DAMAGE = st.lists(
    st.tuples(NUMBERS, st.integers(0, len(MUTATIONS) - 1), st.integers(0, 4000), NUMBERS),
    min_size=1,
    max_size=6,
)


@pytest.fixture(scope='module')
def session():
    return recorded_session()


def test_a_sound_session_is_read_to_its_end(session):
    assert use(DamagedLidar(session, [])).published == SCANS


@settings(max_examples=150)
@given(damage=DAMAGE, turn_ns=st.sampled_from([0, TURN_NS, 7 * TURN_NS, 10**18]))
def test_damaged_sessions_end_by_a_device_error_only(session, damage, turn_ns):
    account = use(DamagedLidar(session, damage, turn_ns))
    assert account.published <= 2 * SCANS
