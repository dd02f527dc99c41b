from nodlidar_servo.bus.reply_timeout import LONGEST_REPLY, ReplyTimeout
import pytest

SIZE = 22  # a read of 8 bytes and its reply: 220 us at 1 Mbit/s


def learned(latency, baud_rate=1_000_000):
    timeout = ReplyTimeout(baud_rate)
    for _ in range(10):
        timeout.add(SIZE, round(SIZE * 10e9 / baud_rate + latency * 1e9))
    return timeout


def test_before_anything_is_known_replies_are_waited_for_as_long_as_they_may_take():
    assert ReplyTimeout(1_000_000).seconds(SIZE, 0) == LONGEST_REPLY


@pytest.mark.parametrize(
    ('latency', 'baud_rate', 'seconds'),
    [
        (0.0, 1_000_000, 0.004),  # 0.22 + 3 ms
        (0.001, 1_000_000, 0.005),
        (0.016, 1_000_000, 0.020),
        (0.001, 57_600, 0.008),  # 3.82 ms on the wire
    ],
)
def test_a_reply_that_is_some_ms_later_than_usual_does_not_come(latency, baud_rate, seconds):
    assert learned(latency, baud_rate).seconds(SIZE, 0) == pytest.approx(seconds)


def test_single_losses_leave_it_and_many_begin_anew():
    timeout = learned(0.0)
    is_longest = [timeout.seconds(SIZE, missed) == LONGEST_REPLY for missed in range(7)]
    assert is_longest == 5 * [0] + 2 * [1]


def test_a_longer_reply_is_waited_for_longer():
    timeout = learned(0.0, 9600)
    assert timeout.seconds(44, 0) == pytest.approx(
        timeout.seconds(22, 0) + 22 * 10 / 9600, abs=2e-3
    )
