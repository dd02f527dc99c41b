"""The driver without ROS on the emulated lidar's bytes, in virtual time, against its truth."""

from dataclasses import replace

from lidar_rig import FULL, Rig, room, START_NS, URG
from nodlidar_common.host_time import HostTime
from nodlidar_driver.scip.diagnosis import ScipDiagnosis
from nodlidar_driver.scip.lidar import Scan
from nodlidar_driver.scip.scan_window import scan_window
from nodlidar_sim.ports.virtual_port import VirtualClock
import numpy as np
import pytest

T_S = 0.1 / 1024


def diagnose(rig):
    """Return the diagnosis of a rig's lidars."""
    return ScipDiagnosis(0, rig.account)


@pytest.mark.parametrize('rate', [1.0, 1.0 + 1e-4, 1.0 - 3e-4])
@pytest.mark.parametrize('phase', [0.0, 0.613])
def test_stamps_are_when_the_first_beam_was_fired(rate, phase):
    rig = Rig(clock_rate=rate, rotation_phase=phase, timer=2**24 - 9000.4)
    lidar = rig.lidar()
    scans = [lidar.read() for _ in range(120)]
    errors = [s.stamp_ns - rig.truth.beam_time_ns(FULL.angle_min, s.stamp_ns) for s in scans]
    assert np.abs(errors).max() < 500_000
    assert np.sqrt(np.mean(np.square(errors[20:]))) < 100_000
    assert lidar.device_clock.drift_ppm == pytest.approx((rate - 1.0) * 1e6, abs=15.0)
    assert scans[-1].revolution == pytest.approx(0.1 / rate, rel=2e-5)
    assert rig.account.lost.total() == 0


@pytest.mark.parametrize('phase', [0.0, 0.3, 0.7])
@pytest.mark.parametrize('command', [b'', b'TM0', b'MD0044072501000'])
def test_the_first_scan_comes_soon(phase, command):
    rig = Rig(rotation_phase=phase)
    if command:
        rig.send(command)
    begin_ns = rig.clock()
    rig.lidar().read()
    assert rig.clock() - begin_ns < 1_700_000_000


def test_arrival_is_after_the_scan_was_sent():
    rig = Rig()
    scan = rig.lidar().read()
    start = rig.truth.beam_time_ns(FULL.angle_min, scan.stamp_ns) - round(44 * T_S * 1e9)
    assert scan.arrival_ns - start == pytest.approx(102.3e6, abs=0.5e6)


def test_ranges_are_those_of_their_azimuths():
    window = scan_window(-1.0, 1.5, 1, 0, URG)
    scan = Rig().lidar(window).read()
    azimuth = window.angle_min + window.angle_increment * np.arange(window.count)
    np.testing.assert_allclose(scan.ranges, room(azimuth), atol=0.00051)


def test_clusters_have_the_least_range_at_their_centre_in_angle_and_time():
    rig, window = Rig(), scan_window(-1.0, 1.5, 5, 0, URG)
    lidar = rig.lidar(window)
    scan = [lidar.read() for _ in range(20)][-1]
    centre = window.angle_min + window.angle_increment * np.arange(window.count)
    least = room(centre - 2.0 * window.angle_increment / 5.0)
    np.testing.assert_allclose(scan.ranges, least, atol=0.00051)
    truth = rig.truth.beam_time_ns(window.angle_min, scan.stamp_ns)
    assert abs(scan.stamp_ns - truth) < 200_000


def test_skipped_scans_are_not_missed():
    rig, window = Rig(), scan_window(-2.0862, 2.0924, 1, 4, URG)
    lidar = rig.lidar(window)
    stamps = np.array([lidar.read().stamp_ns for _ in range(10)])
    np.testing.assert_allclose(np.diff(stamps) / 1e9, 0.5, atol=1e-3)
    assert rig.account.lost['missed'] == 0


def test_a_scan_that_the_host_lost_is_missed():
    rig = Rig()
    lidar = rig.lidar()
    lidar.read()
    rig.clock.advance_to(rig.clock() + 350_000_000)
    rig.port.reset_input_buffer()
    lidar.read()
    assert rig.account.lost['missed'] >= 3


def test_the_diagnosis_reports_identity_rate_losses_and_clock():
    rig = Rig(clock_rate=1.0 + 5e-5)
    diagnosis = diagnose(rig)
    assert 'Device ID' not in diagnosis.next_report(0).figures
    lidar = rig.lidar()
    diagnosis.connected(lidar, rig.clock())
    assert 'Device ID' not in diagnosis.next_report(rig.clock()).figures
    for _ in range(100):
        diagnosis.published(lidar.read())
    first = diagnosis.next_report(rig.clock()).figures
    assert 'Computed Latency' in first
    assert 'Scan rate' not in first  # it counts from here
    for _ in range(20):
        diagnosis.published(lidar.read())
    report = diagnosis.next_report(rig.clock())
    assert report.warnings == ()
    assert report.figures['Device ID'] == 'H0000001'
    assert report.figures['Device Status'] == 'Sensor works well.'
    assert report.figures['Scan rate'] == '10.00 Hz'
    assert float(report.figures['Computed Latency'].split()[0]) == pytest.approx(98.0, abs=0.3)
    assert float(report.figures['Clock drift'].split()[0]) == pytest.approx(50.0, abs=5.0)
    assert report.figures['Scans published'] == '120'
    assert report.figures['Scans due'] == '120'


def test_the_diagnosis_warns_of_each_trouble_once_and_counts_over_connections():
    rig = Rig()
    diagnosis = diagnose(rig)
    lidar = rig.lidar()
    diagnosis.connected(lidar, rig.clock())
    diagnosis.published(lidar.read())
    diagnosis.next_report(rig.clock())
    rig.emulator.sensor.faults.come(21, 98)
    for _ in range(8):
        diagnosis.published(lidar.read())
    warnings = diagnosis.next_report(rig.clock()).warnings
    assert warnings == ('scans dropped: verifying: 1 more', 'scans missed: 1 more')
    for _ in range(8):
        diagnosis.published(lidar.read())
    assert diagnosis.next_report(rig.clock()).warnings == ()
    diagnosis.disconnected()
    assert diagnosis.next_report(rig.clock()).warnings == ()
    lidar = rig.lidar()
    diagnosis.connected(lidar, rig.clock())
    diagnosis.published(lidar.read())
    assert diagnosis.next_report(rig.clock()).figures['Scans dropped: verifying'] == '1'


def test_the_diagnosis_warns_of_late_scans():
    rig = Rig()
    diagnosis = diagnose(rig)
    lidar = rig.lidar()
    diagnosis.connected(lidar, rig.clock())
    for _ in range(5):
        diagnosis.published(lidar.read())
    assert diagnosis.next_report(rig.clock()).warnings == ()
    rig.clock.advance_to(rig.clock() + 1_300_000_000)
    for _ in range(15):
        diagnosis.published(lidar.read())
    late = 'scans came up to 1.2 s late; their stamps are right'
    assert diagnosis.next_report(rig.clock()).warnings == (late,)
    assert diagnosis.next_report(rig.clock()).warnings == ()
    assert rig.account.lost.total() == 0


def test_a_late_scan_is_told_of_at_once():
    rig = Rig()
    diagnosis = diagnose(rig)
    before = diagnosis.urgent(rig.clock())
    for late, is_urgent in ((0.004, False), (0.03, True)):
        diagnosis.published(Scan(0, 0.1, np.zeros(1, np.float32), 0, late))
        assert (diagnosis.urgent(rig.clock()) != before) == is_urgent
    assert diagnosis.next_report(rig.clock()).warnings[0] == (
        'scans came up to 0.03 s late; their stamps are right'
    )


def test_scans_that_are_a_little_late_are_told_of_if_they_are_many():
    rig = Rig()
    diagnosis = diagnose(rig)
    for lateness, warned in (([0.0] * 9 + [0.009], False), ([0.001, 0.005] * 5, True)):
        for late in lateness:
            diagnosis.published(Scan(0, 0.1, np.zeros(1, np.float32), 0, late))
        warnings = diagnosis.next_report(rig.clock()).warnings
        assert warnings == warned * ('scans came up to 0.005 s late; their stamps are right',)


def test_the_diagnosis_warns_of_a_clock_that_was_set():
    rig, wall = Rig(), VirtualClock(START_NS)
    host_time = HostTime(wall, rig.clock)
    diagnosis = diagnose(rig)
    diagnosis.clock_set(host_time.update())
    assert diagnosis.next_report(0).warnings == ()
    wall.now_ns -= 2_500_000_000
    diagnosis.clock_set(host_time.update())
    assert diagnosis.next_report(0).warnings == ("the host's clock was set by -2.5 s",)
    assert diagnosis.next_report(0).figures['Host clock steps'] == '1'


def test_the_diagnosis_warns_of_a_slow_stream_and_at_once_of_silence():
    rig = Rig()
    diagnosis = diagnose(rig)
    lidar = rig.lidar()
    diagnosis.connected(lidar, rig.clock())
    diagnosis.published(lidar.read())
    diagnosis.next_report(rig.clock())
    diagnosis.published(lidar.read())
    well = diagnosis.urgent(rig.clock() + 490_000_000)
    assert diagnosis.urgent(rig.clock()) == well
    assert diagnosis.urgent(rig.clock() + 510_000_000) != well
    warnings = diagnosis.next_report(rig.clock() + 900_000_000).warnings
    assert warnings == ('no scan for 0.9 s', '1.0 scans/s instead of 10.0')


def test_a_loss_is_urgent_and_a_stop_leaves_nothing_uncounted():
    rig = Rig()
    diagnosis = diagnose(rig)
    lidar = rig.lidar()
    lidar.read()
    well = diagnosis.urgent(rig.clock())
    rig.clock.advance_to(rig.clock() + 350_000_000)
    rig.port.reset_input_buffer()
    diagnosis.published(replace(lidar.read(), late=0.0))  # lateness is urgent, too
    assert diagnosis.urgent(rig.clock()) != well
    assert rig.account.lost['missed'] == 3
    rig.clock.advance_to(rig.clock() + 420_000_000)
    lidar.disconnect()
    assert rig.account.due == len(rig.sent)


@pytest.mark.parametrize('skip', [0, 4, 9])
def test_a_stream_at_its_rate_is_not_slow_however_reports_and_scans_meet(skip):
    window = scan_window(-2.0862, 2.0924, 1, skip, URG)
    rig = Rig()
    diagnosis = ScipDiagnosis(skip, rig.account)
    lidar = rig.lidar(window)
    diagnosis.connected(lidar, rig.clock())
    warnings, next_ns = [], rig.clock()
    for _ in range(200 // (skip + 1)):
        diagnosis.published(lidar.read())
        while next_ns <= rig.clock():
            warnings += diagnosis.next_report(next_ns).warnings
            next_ns += 930_000_000  # about a second, at all phases of the scans
    assert warnings == []
