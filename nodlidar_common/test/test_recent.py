from collections import Counter

from nodlidar_common.recent import Recent

SECOND = 1_000_000_000


def test_nothing_is_known_before_two_additions():
    recent = Recent(1.5)
    assert (recent.duration, recent.counts) == (0.0, Counter())
    recent.add(SECOND, Counter(samples=7))
    assert (recent.duration, recent.counts) == (0.0, Counter())


def test_the_counts_are_those_of_at_least_the_window():
    recent = Recent(1.5)
    for second in range(10):
        recent.add(second * SECOND, Counter(samples=100 * second, failures=second // 9))
    assert recent.duration == 2.0
    assert recent.counts == Counter(samples=200, failures=1)


def test_the_last_addition_but_one_is_kept_however_old_it_is():
    recent = Recent(1.5)
    recent.add(0, Counter())
    recent.add(10 * SECOND, Counter(samples=50))
    assert (recent.duration, recent.counts) == (10.0, Counter(samples=50))


def test_after_clearing_counting_restarts():
    recent = Recent(1.5)
    recent.add(0, Counter(samples=1))
    recent.add(SECOND, Counter(samples=2))
    recent.clear()
    recent.add(2 * SECOND, Counter(samples=3))
    assert recent.duration == 0.0
