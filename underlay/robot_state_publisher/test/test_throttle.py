from robot_state_publisher.throttle import Throttle

MS = 1_000_000
NOW = 1_700_000_000_000 * MS


def published(throttle, names, stamps_ms, now=NOW, interval=50 * MS):
    """Offer states at stamps after NOW [ms]; return those that are due."""
    result = []
    for stamp in stamps_ms:
        if throttle.due(names, NOW + stamp * MS, now, interval):
            throttle.published(names, NOW + stamp * MS)
            result.append(stamp)
    return result


def test_stamps_are_an_interval_apart():
    throttle = Throttle()
    assert published(throttle, ['a'], range(-200, 1, 20)) == [-200, -140, -80, -20]


def test_joints_are_independent_and_the_longest_unpublished_one_decides():
    throttle = Throttle()
    assert published(throttle, ['a'], [-100]) == [-100]
    assert published(throttle, ['b'], [-90]) == [-90]
    assert published(throttle, ['a', 'b'], [-60, -50, -45, 0]) == [-50, 0]
    assert published(throttle, ['a', 'new'], [5]) == [5]


def test_a_stamp_in_the_future_does_not_block_what_follows():
    throttle = Throttle()
    assert published(throttle, ['a'], [10_000]) == [10_000]
    assert published(throttle, ['a'], [49, 50], now=NOW) == [50]


def test_clock_turned_back():
    throttle = Throttle()
    assert not throttle.went_back(NOW)
    assert published(throttle, ['a'], [0, 10]) == [0]
    assert throttle.went_back(NOW - 1)
    assert published(throttle, ['a'], [10]) == [10]
    assert not throttle.went_back(NOW)
