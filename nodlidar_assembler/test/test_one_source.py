"""Messages of one of several sources count."""

from nodlidar_assembler.inputs.one_source import OneSource

MS = 1_000_000


def admitted(*messages):
    """Return the messages (source, ms) that count, of two that alternate and so on."""
    source = OneSource()
    return [(name, ms) for name, ms in messages if source.admits(name, ms * MS)]


def test_the_source_that_was_heard_first_counts():
    messages = [('ab'[k % 2], 100 * k) for k in range(50)]
    assert admitted(*messages) == messages[::2]


def test_another_one_counts_once_it_is_silent_for_a_second():
    messages = [('a', 0), ('b', 900), ('b', 1000), ('b', 1100), ('a', 1200), ('b', 1300)]
    assert admitted(*messages) == [('a', 0), ('b', 1100), ('b', 1300)]


def test_after_time_went_back_any_source_counts():
    assert admitted(('a', 5000), ('b', 1000), ('a', 1100)) == [('a', 5000), ('b', 1000)]
