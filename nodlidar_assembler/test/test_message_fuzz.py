"""No message ends the assembler, nor makes it fail inside, nor keeps memory for good."""

from hypothesis import given, HealthCheck, settings
from hypothesis import strategies as st
from message_fuzz import fed, Messages
import pytest

SETUPS = {
    'scan': (),
    'sweep': ('cloud_mode:=sweep', 'estimator:=trajectory', 'deadline:=0.01'),
    'feedback': ('nod_mode:=feedback', 'adapt_limits:=true', 'estimator:=ends'),
    'odometry': ('ego_motion:=beam', 'without_odometry:=uncompensated'),
}


@pytest.mark.parametrize('parameters', SETUPS.values(), ids=SETUPS)
def test_whatever_comes_nothing_fails_and_good_messages_make_clouds_again(parameters):
    with fed(*parameters) as running:
        counts = running.node.diagnosis.counts

        @settings(max_examples=15, suppress_health_check=list(HealthCheck))
        @given(st.integers(0, 2**32), st.floats(0.0, 0.9))
        def feed_at_random(seed, wrong):
            messages = Messages(seed, wrong)
            for _ in range(60):
                running.feed(*messages.next())

        feed_at_random()
        assert running.node.survival.errors == {}
        before, messages = counts['clouds'], Messages(1, 0.0)
        for _ in range(3000):
            running.feed(*messages.next())
        assert counts['clouds'] > before
        assert running.node.survival.errors == {}
