"""The assembler on another machine than driver and servo, over a line that delays and loses.

Where network namespaces cannot be made, a relay between two domains is the line, and a warning
says so.
"""

import pytest

from bench.network.machines import Line
from bench.network.network import BEST_EFFORT, ENVIRONMENT, LOSSY, profiles
from bench.network.network_judgement import account
from bench.network.network_rig import NetworkRig
from bench.network.relay import joined

LINE = Line(loss=0.1, delay=0.02, jitter=0.005)


@pytest.fixture(scope='module')
def found(tmp_path_factory):
    environment = ENVIRONMENT | profiles(LOSSY)
    with joined(LINE, environment) as (robot, far):
        # Best effort: what is lost stays lost.
        rig = NetworkRig(tmp_path_factory.mktemp('network'), robot, far, BEST_EFFORT)
        with rig.running():
            rig.until_clouds(15)
            rig.end_scans()
        return account(rig.here(), rig.there(), rig.truth)


def test_every_scan_is_in_a_cloud_or_in_a_count(found):
    assert found.sent >= 15
    assert found.unaccounted == 0
    assert found.undecided == 0


def test_no_cloud_comes_twice_or_from_nowhere(found):
    assert found.strangers == 0


def test_clouds_are_where_the_beams_hit(found):
    """Also where joint states were lost between the neighbours of a beam."""
    assert found.error.max() < 0.02


def test_clouds_are_late_by_the_line_and_not_by_much_more(found):
    assert found.late.min() > LINE.delay
    assert sorted(found.late)[len(found.late) // 2] < 0.25
