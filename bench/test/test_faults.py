"""The judge of a faulty system is itself judged: a recording whose errors are known."""

from dataclasses import replace
import math

from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig
from nodlidar_demo.simulated_log import simulated_log
from nodlidar_servo.bus.replies import PositionError
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.device.servo import Servo
from nodlidar_sim.devices.rx_motor import TICK
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.faulty_servo import FaultyServo
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.sensor_model import SensorModel
import numpy as np
import pytest

from bench.faults.fault_errors import errors
from bench.faults.fault_judgement import Episode, Judge
from bench.faults.fault_kinds import KINDS, schedule
from bench.faults.fault_log import Cloud, Published, Status
from bench.faults.fault_naming import named
from bench.faults.fault_rows import row
from bench.faults.fault_truth import Changes, TrueScan, Truth
from bench.shared.reference import reference_nod, START_NS

DURATION = 12.0
LATENCY_NS = 40_000_000
S = 1_000_000_000
FAULT = Episode(
    'a fault', '', START_NS + 4 * S, START_NS + 6 * S, START_NS + 6 * S, START_NS + 4 * S,
    START_NS + 11 * S,
)  # fmt: skip


@pytest.fixture(scope='module')
def recording():
    scene = replace(load_scene('room', ideal=True), effects=Effects(range_noise=0.002))
    sensor = SensorModel(joint_rate=1000.0, joint_tick=1e-6)
    return simulate(scene, reference_nod(), DURATION, start_ns=START_NS, sensor=sensor)


@pytest.fixture(scope='module')
def truth(recording):
    truth = Truth(recording.world.motion)
    codes = np.rint(np.where(np.isfinite(recording.ranges), recording.ranges, 0.0) * 1e3)
    truth.scans = [
        TrueScan(times_ns, code, pitch, True)
        for times_ns, code, pitch in zip(
            recording.true_time_ns, codes.astype(np.int64), recording.true_pitch, strict=True
        )
    ]
    truth.torque.note(START_NS, True)
    truth.laser.note(START_NS, True)
    return truth


def statuses(**of_node):
    """Return the diagnostics of a second each: of 'driver', 'servo', 'assembler'."""
    return [
        Status(START_NS + second * S + S // 2, f'{node}: device', *of_node[node](second))
        if node in of_node
        else Status(START_NS + second * S + S // 2, f'{node}: device', 0, 'fine', {})
        for second in range(int(DURATION))
        for node in ('driver', 'servo', 'assembler')
    ]


def published(recording, spoil=lambda scan: scan, without=(), diagnostics=None):
    """Return what a sound sensor publishes, with its scans changed, without some clouds."""
    log = simulated_log(recording)
    pipeline = Pipeline(PipelineConfig(mixed_pixel_angle=0.0))
    scans, clouds = [], []
    for i, sound in enumerate(log.scans):
        scan = spoil(sound)
        at_ns = sound.stamp_ns + 70_000_000 + LATENCY_NS
        scans.append((at_ns, scan))
        if 0 < i < len(log.scans) - 1 and i not in without:
            points = pipeline.add_scan(scan, log.sample_ns, log.sample_pitch).clouds[0]
            clouds.append((at_ns, Cloud(int(points.time_ns[0]), points.xyz)))
    return Published(scans, clouds, diagnostics or statuses())


def judged(recorded, truth, episode=FAULT, launches=(START_NS,)):
    healthy_ns = (START_NS, START_NS + 4 * S)
    return Judge(recorded, truth, errors(recorded, truth), healthy_ns, launches).judge(episode)


def spoilt_at(second, change):
    """Return what changes the one scan that begins in a tenth of a second."""

    def spoil(scan):
        late = scan.stamp_ns - (START_NS + round(second * S))
        return change(scan) if 0 <= late < S // 10 else scan

    return spoil


def test_a_sound_recording_has_no_errors(recording, truth):
    judgement = judged(published(recording), truth)
    assert judgement.stamp < 1e-6
    assert judgement.cloud < 1e-3
    assert judgement.clouds_off == judgement.stamps_off == 0
    assert judgement.changed == judgement.missing == judgement.unaccounted == 0
    assert judgement.healed == 0.0
    assert math.isinf(judgement.named)


def test_a_wrong_stamp_is_found_and_what_it_does_to_the_cloud(recording, truth):
    late = spoilt_at(5.0, lambda scan: replace(scan, stamp_ns=scan.stamp_ns + 30_000_000))
    judgement = judged(published(recording, late), truth)
    assert judgement.stamp == pytest.approx(0.030, abs=1e-6)
    assert (judgement.stamps_off, judgement.clouds_off) == (1, 1)
    assert 0.01 < judgement.cloud < 0.3  # up to 0.03 s at pi rad/s, at up to 3 m


def test_errors_before_a_fault_are_not_its(recording, truth):
    late = spoilt_at(3.0, lambda scan: replace(scan, stamp_ns=scan.stamp_ns + 30_000_000))
    assert judged(published(recording, late), truth).stamp < 1e-6


def test_a_cloud_that_was_moved_is_found(recording, truth):
    recorded = published(recording)
    for at_ns, cloud in recorded.clouds:
        if START_NS + 5 * S < at_ns < START_NS + 5 * S + S // 10:
            cloud.xyz[:, 0] += 0.05
    assert judged(recorded, truth).cloud == pytest.approx(0.05, abs=2e-3)


def test_a_range_that_the_lidar_did_not_send_is_found(recording, truth):
    def change(scan):
        ranges = scan.ranges.copy()
        ranges[100:103] += 0.5
        return replace(scan, ranges=ranges)

    judgement = judged(published(recording, spoilt_at(5.0, change)), truth)
    assert judgement.changed == 3
    assert judgement.cloud < 1e-3


@pytest.mark.parametrize(('counted', 'unaccounted'), [(0, 7), (4, 3), (7, 0)])
def test_what_was_lost_and_not_counted_is_unaccounted(recording, truth, counted, unaccounted):
    def assembler(second):
        return 0, 'fine', {'clouds': str(second), 'dropped: late': str(counted * (second >= 5))}

    recorded = published(
        recording, without=range(45, 52), diagnostics=statuses(assembler=assembler)
    )
    judgement = judged(recorded, truth)
    assert judgement.missing == 7
    assert judgement.unaccounted == unaccounted


def test_after_a_relaunch_nodes_count_anew(recording, truth):
    def assembler(second):
        return 0, 'fine', {'dropped: late': '50' if second < 4 else str(7 * (second >= 8))}

    recorded = published(
        recording, without=range(75, 82), diagnostics=statuses(assembler=assembler)
    )
    again = replace(FAULT, relaunched=True)
    assert judged(recorded, truth, again, (START_NS, again.mended_ns)).unaccounted == 0
    assert judged(recorded, truth, again).unaccounted == 7


def test_scans_that_were_not_published_are_missing_and_those_that_none_heard_are_not(
    recording, truth
):
    recorded = published(recording, without=range(45, 52))
    del recorded.scans[45:52]
    assert judged(recorded, truth).missing == 7
    deaf = Truth(recording.world.motion)
    deaf.scans = [replace(s, heard=not 45 <= i < 52) for i, s in enumerate(truth.scans)]
    assert judged(recorded, deaf).missing == 0


def test_clouds_heal_when_they_come_at_their_rate_again(recording, truth):
    recorded = published(recording, without=range(45, 80))
    judgement = judged(recorded, truth)
    assert judgement.healed == pytest.approx(2.1, abs=0.11)
    endless = published(recording, without=range(45, 119))
    assert math.isinf(judged(endless, truth).healed)


def test_a_fault_is_named_by_new_words_not_by_new_figures():
    def driver(second):
        return (1, f'{second} scans dropped', {}) if second >= 4 else (1, '7 scans late', {})

    diagnostics = statuses(driver=driver)
    after, text = named(diagnostics, START_NS + 4 * S, START_NS + 8 * S)
    assert after == pytest.approx(0.5)
    assert text == 'driver: device: 4 scans dropped'
    assert math.isinf(named(diagnostics, START_NS + 6 * S, START_NS + 8 * S)[0])


def test_diagnostics_that_stay_away_name_a_fault():
    heard = [s for s in statuses() if 'servo' not in s.name or s.time_ns < START_NS + 4 * S]
    after, text = named(heard, START_NS + 4 * S, START_NS + 9 * S)
    assert after == pytest.approx(1.0)  # one and a half periods after the last, at 3.5 s
    assert text == 'servo: device: nothing more comes'


def test_torque_that_stays_on_never_went_off():
    torque = Changes()
    for second, on in ((0, True), (1, True), (5, False), (8, True)):
        torque.note(START_NS + second * S, on)
    assert torque.off_after(START_NS + 3 * S, START_NS + 7 * S) == pytest.approx(2.0)
    assert math.isinf(torque.off_after(START_NS + 3 * S, START_NS + 4 * S))
    assert torque.off_after(START_NS + 6 * S, START_NS + 7 * S) == 0.0
    assert math.isinf(torque.off_after(START_NS + 9 * S, START_NS + 12 * S))


def test_a_row_has_the_worst_and_how_many_were_in_time(recording, truth):
    judgement = judged(published(recording), truth)
    judgements = [replace(judgement, named=t, text='it broke') for t in (0.4, 0.9, 1.4)]
    worst = row('a fault', judgements)
    assert worst['named in 1 s'] == '2 of 3'
    assert worst['named [s]'] == 1.4
    assert worst['named as'] == 'it broke'
    assert row('another', [judgement])['named as'] == ''
    assert worst['torque off [s]'] is None


def test_every_fault_occurs_and_those_that_end_the_launch_come_last():
    kinds = schedule(seed=3)
    assert {kind.name for kind in kinds} == set(KINDS)
    ends = [kind.ends_launch for kind in kinds]
    assert ends == sorted(ends)
    assert (
        [k.name for k in schedule(3)] == [k.name for k in kinds] != [k.name for k in schedule(4)]
    )
    assert {k.name for k in schedule(1, 'unplugged')} == {'lidar: unplugged', 'servo: unplugged'}
    with pytest.raises(ValueError, match='no fault has'):
        schedule(1, 'meteorite')


def driven(motion, driver, clock, goal):
    """Return readings and true pitch [rad] of a second with a goal; NaN where one is refused."""
    driver.drive(goal, 2.0)
    readings = []
    for _ in range(100):
        clock.advance_to(clock() + S // 100)
        truth = float(motion.position(np.array([clock()]))[0])
        try:
            readings.append((driver.read().pitch, truth))
        except PositionError:
            readings.append((math.nan, truth))
    return np.array(readings).T


def test_the_driver_reads_what_the_faults_of_the_servo_make_of_its_motion():
    motion, clock = FaultyServo(seed=1), VirtualClock(START_NS)
    driver = Servo(VirtualPort(RxServoEmulator(motion, baud=1), clock), ServoConfig(), clock)
    driver.connect()
    driver.set_torque(True)
    told, truth = driven(motion, driver, clock, 0.5)
    assert told == pytest.approx(truth, abs=TICK)
    assert truth[-1] == pytest.approx(0.5, abs=TICK)
    assert motion.first_hit_ns is None

    motion.frozen = 0.5
    told, truth = driven(motion, driver, clock, -0.5)
    assert told == pytest.approx(0.5, abs=TICK)
    assert truth[-1] == pytest.approx(-0.5, abs=TICK)  # the motor works
    assert motion.first_hit_ns > START_NS + S

    motion.frozen, motion.blocked = -0.5, True
    told, truth = driven(motion, driver, clock, 0.5)
    assert truth == pytest.approx(-0.5, abs=TICK)

    motion.mend()
    motion.spike_rate = 0.3
    told, truth = driven(motion, driver, clock, 0.4)
    assert 15 < np.count_nonzero(~(np.abs(told - truth) < 2.0 * TICK)) < 60
    assert truth[-1] == pytest.approx(0.4, abs=TICK)
