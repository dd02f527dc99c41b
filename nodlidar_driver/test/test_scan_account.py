"""Every scan that was due is counted once, whatever becomes of it."""

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_driver.scip.scan_account import MISSED, REASONS, ScanAccount

GOOD, SILENT = 'good', 'silent'
FATES = st.sampled_from([GOOD, SILENT, *(reason for reason in REASONS if reason != MISSED)])


@given(st.lists(st.tuples(FATES, st.integers(1, 3)), max_size=60), st.booleans())
def test_scans_that_were_due_are_those_published_and_each_lost_one(fates, end_is_known):
    """Send scans with their fates; a damaged one may fall into several pieces."""
    account, since, begun, due = ScanAccount(), 0, False, 0
    for fate, pieces in [(GOOD, 1), *fates]:
        since, due = since + 1, due + 1
        if fate == GOOD:
            account.publish(since if begun else None)
            since, begun = 0, True
        elif fate != SILENT:
            for _ in range(pieces):
                account.drop(fate)
    account.end(since if end_is_known else None)
    assert account.published == 1 + sum(fate == GOOD for fate, _ in fates)
    assert account.due == account.published + sum(account.lost.values())
    assert account.due == due or not end_is_known


@given(st.lists(FATES, max_size=60))
def test_without_pieces_each_reason_is_exact_but_for_the_order_of_silence(fates):
    account, since = ScanAccount(), 0
    account.publish(None)
    for fate in [*fates, GOOD]:
        since += 1
        if fate == GOOD:
            account.publish(since)
            since = 0
        elif fate != SILENT:
            account.drop(fate)
    for reason in REASONS:
        told = SILENT if reason == MISSED else reason
        assert account.lost[reason] == fates.count(told)


def test_what_came_before_the_first_scan_of_a_stream_is_counted_as_received():
    account = ScanAccount()
    account.drop('settling')
    account.drop('checksum')
    account.publish(None)
    account.drop('checksum')
    account.end(3)
    account.drop('incomplete')
    account.end(None)
    assert account.due == 7
    assert +account.lost == {'settling': 1, 'checksum': 2, 'missed': 2, 'incomplete': 1}
