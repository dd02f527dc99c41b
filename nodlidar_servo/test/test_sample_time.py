from nodlidar_servo.device.sample_time import sample_time_ns, UsualExcess, WireTime
import pytest

RX24F_READ = WireTime.of_read(request=8, reply=14, baud_rate=1_000_000, delay_ns=0)


def test_a_block_read_takes_220_us_on_the_wire_and_720_with_the_factory_delay():
    assert WireTime(80_000, 0, 140_000) == RX24F_READ
    factory = WireTime.of_read(8, 14, 1_000_000, 250 * 2000)
    assert factory.request_ns + factory.delay_ns + factory.reply_ns == 720_000


@pytest.mark.parametrize(
    ('way_out_us', 'way_back_us', 'error_us'),
    [
        (0, 0, 0),
        (200, 200, 0),  # equal ways: exact
        (500, 500, 0),
        (0, 1000, 500),  # one frame, all of it on one way: half a frame
        (1000, 0, -500),
        (0, 15_000, 500),  # the latency timer does not count
        (500, 16_000, 0),
    ],
)
def test_what_is_beyond_one_usb_frame_is_taken_for_the_way_back(way_out_us, way_back_us, error_us):
    measured = 10**18
    sent = measured - RX24F_READ.request_ns - way_out_us * 1000
    received = measured + RX24F_READ.reply_ns + way_back_us * 1000
    assert sample_time_ns(sent, received, RX24F_READ) - measured == error_us * 1000


def test_the_return_delay_is_halved():
    wire = WireTime.of_read(8, 14, 1_000_000, 500_000)
    assert sample_time_ns(0, 720_000, wire) == 80_000 + 250_000


def test_a_transaction_faster_than_the_wire_has_no_excess():
    assert sample_time_ns(1000, 2000, RX24F_READ) == 81_000


MS = 1_000_000


@pytest.mark.parametrize(('timer_ns', 'longest_ns'), [(0, MS), (MS, 2 * MS), (16 * MS, 17 * MS)])
def test_what_takes_a_frame_longer_than_the_adapter_needs_is_not_usual(timer_ns, longest_ns):
    usual = UsualExcess(timer_ns, 50)
    assert usual.add(0)
    assert usual.add(longest_ns)
    assert not usual.add(longest_ns + 1)


def test_a_wait_that_grows_for_all_becomes_usual_when_the_shorter_ones_are_forgotten():
    usual = UsualExcess(0, 50)
    assert all(usual.add(200_000) for _ in range(100))
    assert [usual.add(6 * MS) for _ in range(60)] == 49 * [False] + 11 * [True]


def test_no_wait_is_usual_that_is_longer_than_an_adapter_makes_it():
    usual = UsualExcess(0, 5)
    assert not any(usual.add(21 * MS) for _ in range(20))
