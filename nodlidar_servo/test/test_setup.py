"""The set-up of a servo, at byte level: every bit rate, ID and fault put in, in virtual time."""

from contextlib import contextmanager
from dataclasses import replace
import re

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameter_file import file_values
from nodlidar_servo.bus.packets import PROTOCOL_1, PROTOCOL_2
from nodlidar_servo.commands.entry_points import setup
from nodlidar_servo.commands.setup import (
    check_lidar,
    node_parameters,
    parameter_file,
    Port,
    start_command,
)
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.device.servo import Servo
from nodlidar_servo.setup.dialogue import Dialogue, Wish
from nodlidar_servo.setup.errors import (
    LidarError,
    LockedError,
    NoServoError,
    NotWrittenError,
    SeveralServosError,
    SharedIdError,
    WrongModelError,
)
from nodlidar_servo.setup.registers import rate_code, rate_of, registers_of
from nodlidar_servo.setup.search import answers, Found, is_shared, rare_trials, RATES_1
from nodlidar_sim.devices import rx_table as rx
from nodlidar_sim.devices import x_table as x
from nodlidar_sim.devices.device import SilentDevice
from nodlidar_sim.devices.faults import EchoingDevice, FaultyDevice
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.devices.shared_bus import SharedBus
from nodlidar_sim.devices.streaming_lidar import StreamingLidar
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.devices.x_servo import XServoEmulator
from nodlidar_sim.ports.pseudo_terminals import HostClock, PseudoTerminals
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
from nodlidar_sim.world.ideal_servo import IdealServo
import numpy as np
import pytest
import yaml

CLOCK = VirtualClock(1_800_000_000_000_000_000)
KINDS = [(RxServoEmulator, rx), (XServoEmulator, x)]
READY_RX = {rx.CW_LIMIT: 512 - 156, rx.CCW_LIMIT: 512 + 156}  # 0.8 rad of 0.00511 rad
READY_X = {x.MIN_POSITION: 2048 - 522, x.MAX_POSITION: 2048 + 522}  # of 0.00153 rad


class Line:
    """A device's port in virtual time, opened anew at each bit rate; answers every question."""

    def __init__(self, device, yes=True):
        self.device, self.clock = device, CLOCK
        self.yes, self.asked, self.shown = yes, [], []

    @contextmanager
    def __call__(self, rate):
        self.device.host_bit_rate = rate
        yield VirtualPort(self.device, self.clock)

    def agrees(self, question):
        self.asked.append(question)
        return self.yes if isinstance(self.yes, bool) else self.yes(question)

    def set_up(self, **wish):
        dialogue = Dialogue(self, self.agrees, self.shown.append)
        return dialogue.set_up(Wish(**{'level': False, **wish}))


def make(emulator, registers=None, pitch=0.0, **options):
    device = emulator(IdealServo(pitch), **options)
    for register, value in (registers or {}).items():
        device.table[register] = value
    return device


def values(device, registers):
    return {register: device.table[register] for register in registers}


@pytest.mark.parametrize(('kind', 'table'), KINDS)
def test_a_servo_from_the_factory_can_be_nodded_afterwards(kind, table):
    device = make(kind)
    line = Line(device)
    result = line.set_up()
    ready = READY_RX if table is rx else READY_X
    assert values(device, ready) == ready
    assert device.bit_rate == 1_000_000
    assert device.table[table.RETURN_DELAY] == 0
    assert {change.name for change in result.changes} == {
        'lower limit', 'upper limit', 'return delay', 'bit rate',
    }  # fmt: skip
    with line(1_000_000) as port:
        servo = Servo(port, ServoConfig(model=result.config.model), line.clock)
        servo.connect()
        assert servo.read().pitch == pytest.approx(0.0, abs=0.006)
    again = line.set_up()
    assert again.changes == []


@settings(max_examples=25)
@given(st.integers(0, 1), st.integers(0, 252), st.integers(0, 7), st.integers(1, 249))
def test_any_rate_and_id_are_found(which, servo_id, code, rare):
    kind, table = KINDS[which]
    device = make(kind, servo_id=servo_id, baud=code if which else rare)
    line = Line(device)
    result = line.set_up()
    assert result.before.found.servo_id == servo_id
    assert result.before.found.baud_rate == pytest.approx(
        2_000_000 / (rare + 1) if not which else device_rate(code),
        rel=0.031,  # 3 % of the faster
    )
    assert (device.table[table.ID], device.bit_rate) == (1, 1_000_000)


def device_rate(code):
    return (9600, 57_600, 115_200, 1e6, 2e6, 3e6, 4e6, 4.5e6)[code]


@pytest.mark.parametrize(
    ('kind', 'registers', 'words'),
    [
        (RxServoEmulator, {rx.CW_LIMIT: 0, rx.CCW_LIMIT: 0}, 'wheel mode'),
        (XServoEmulator, {x.OPERATING_MODE: 1}, 'operating mode 1'),
        (XServoEmulator, {x.TORQUE_ENABLE: 1}, 'torque is on'),
        (RxServoEmulator, {rx.TORQUE_ENABLE: 1}, 'torque is on'),
        (XServoEmulator, {x.RETURN_LEVEL: 1}, 'return level 1'),
        (RxServoEmulator, {rx.RETURN_LEVEL: 1, rx.TORQUE_ENABLE: 1}, 'return level 1'),
    ],
)
def test_a_fault_is_named_and_mended(kind, registers, words):
    line = Line(make(kind, registers))
    result = line.set_up()
    assert any(words in shown and 'WRONG' in shown for shown in line.shown), line.shown
    assert result.after.faults() == []


@pytest.mark.parametrize(('kind', 'table'), KINDS)
def test_a_servo_that_answers_only_pings_is_mended(kind, table):
    device = make(kind, {table.RETURN_LEVEL: 0, table.TORQUE_ENABLE: 1})
    line = Line(device)
    result = line.set_up()
    assert 'return level' in {change.name for change in result.changes}
    assert values(device, (table.RETURN_LEVEL, table.TORQUE_ENABLE)) == {
        table.RETURN_LEVEL: 2,
        table.TORQUE_ENABLE: 0,
    }


@pytest.mark.parametrize(('kind', 'table'), KINDS)
def test_nothing_is_written_without_consent(kind, table):
    device = make(kind, {table.TORQUE_ENABLE: 1})
    before = device.table.read(0, table.EEPROM_END)
    refusing = Line(device, yes=False)
    assert refusing.set_up().changes == []
    assert len(refusing.asked) == 4
    agreeing = Line(device)
    agreeing.set_up(dry_run=True)
    assert agreeing.asked == []
    assert sum('would change' in line for line in agreeing.shown) == 4
    no_torque = Line(device, yes=lambda question: 'torque' not in question)
    assert no_torque.set_up().changes == []
    assert device.table.read(0, table.EEPROM_END) == before
    assert device.table[table.TORQUE_ENABLE] == 1


def test_each_change_has_its_own_consent():
    device = make(XServoEmulator)
    line = Line(device, yes=lambda question: 'return delay' in question)
    result = line.set_up()
    assert [change.name for change in result.changes] == ['return delay']
    assert (device.table[x.RETURN_DELAY], device.bit_rate) == (0, 57_600)
    assert node_parameters(result.config) == {'baud_rate': 57_600}


@pytest.mark.parametrize(('kind', 'table'), KINDS)
def test_without_consent_to_confirmed_writes_nothing_is_written(kind, table):
    register = rx.RETURN_LEVEL if table is rx else x.RETURN_LEVEL
    device = make(kind, {register: 1})
    line = Line(device, yes=lambda question: 'return level' not in question)
    settings = 0, 24 if table is rx else 64
    before = device.table.read(*settings)
    assert list(line.set_up().changes) == []
    assert device.table.read(*settings) == before
    assert 'nothing is changed: at this return level, no write is confirmed' in line.shown
    assert len(line.asked) == 1


def test_a_servo_that_is_gone_after_a_write_is_an_error_of_that_write():
    device = GoneWithItsNewId(make(RxServoEmulator))
    with pytest.raises(NotWrittenError, match=r'after writing ID = 5 .* run setup again'):
        Line(device).set_up(config=ServoConfig(servo_id=5))


class GoneWithItsNewId:
    """A servo that takes a new ID only after its power was cut."""

    def __init__(self, device):
        self._device, self.host_bit_rate = device, None

    def __getattr__(self, name):
        return getattr(self._device, name)

    def receive(self, data, now_ns):
        self._device.host_bit_rate = self.host_bit_rate
        if self._device.table[rx.ID] != 5:
            self._device.receive(data, now_ns)

    def transmit(self, now_ns):
        sent = self._device.transmit(now_ns)
        return sent if self._device.table[rx.ID] != 5 else b''


@pytest.mark.parametrize(('kind', 'table'), KINDS)
def test_the_present_position_becomes_the_zero(kind, table):
    result = Line(make(kind, pitch=0.1)).set_up(level=True)
    tick = 512 + 19.56 if table is rx else 2048 + 65.19  # 0.1 rad
    assert result.config.zero_tick == pytest.approx(tick, abs=0.51)
    parameters = node_parameters(result.config)
    assert yaml.safe_load(parameter_file(parameters, {})) == {
        '/**': {'ros__parameters': {'zero_tick': result.config.zero_tick}}
    }
    span = 156 if table is rx else 522
    low = result.after.values['lower limit']
    assert low == pytest.approx(result.config.zero_tick - span, abs=1)


def test_a_zero_too_near_to_the_end_is_refused():
    line = Line(make(RxServoEmulator, pitch=2.4))
    with pytest.raises(ParameterError, match="'pitch_upper_limit' must be between"):
        line.set_up(level=True)


def test_interrupted_writing_leaves_the_torque_off():
    device = make(XServoEmulator, {x.TORQUE_ENABLE: 1})
    write = device.table.write

    def interrupted(address, data):
        if address == x.RETURN_DELAY.address:
            raise KeyboardInterrupt
        return write(address, data)

    device.table.write = interrupted
    with pytest.raises(KeyboardInterrupt):
        Line(device).set_up()
    assert device.table[x.TORQUE_ENABLE] == 0


@pytest.mark.parametrize(
    ('device', 'wish', 'error', 'words'),
    [
        (SilentDevice(), {}, NoServoError, 'check its supply'),
        (make(XServoEmulator), {'model': 'RX-24F'}, WrongModelError, 'XL430-W250, not RX-24F'),
        (
            make(XServoEmulator, kind=replace(x.XL430, model=1030)),
            {},
            WrongModelError,
            'model number 1030',
        ),
        (make(RxServoEmulator, {rx.LOCK: 1}), {}, LockedError, 'power off and on'),
        (
            make(XServoEmulator),
            {'config': replace(ServoConfig(), baud_rate=250_000)},
            ParameterError,
            "'baud_rate' must be a rate",
        ),
    ],
)
def test_what_setup_cannot_mend_is_named(device, wish, error, words):
    with pytest.raises(error, match=words):
        Line(device).set_up(**wish)


@pytest.mark.parametrize(('kind', 'table'), KINDS)
@pytest.mark.parametrize('delay', [250, 0])
def test_two_servos_of_one_id_are_named(kind, table, delay):
    servos = make(kind, pitch=0.3), make(kind, pitch=-0.2, return_delay=delay)
    with pytest.raises(SharedIdError, match='two servos have this ID'):
        Line(SharedBus(servos)).set_up()


@pytest.mark.parametrize(
    ('kind', 'packets'), [(RxServoEmulator, PROTOCOL_1), (XServoEmulator, PROTOCOL_2)]
)
@pytest.mark.parametrize('late_ms', [60, 110, 160])
def test_replies_that_come_late_on_a_busy_host_are_not_those_of_a_second_servo(
    kind, packets, late_ms
):
    """Each of the first one, two or three requests gets no reply in time."""
    servo = make(kind)
    where, device = registers_of(packets), FaultyDevice(servo)
    device.stalled_until_ns = CLOCK() + late_ms * 1_000_000
    with Line(device)(servo.bit_rate) as port:
        found = Found(packets, round(servo.bit_rate), 1)
        assert not is_shared(port, found, where.present, where.present_size)


class EchoingLine(Line):
    """A port whose adapter echoes."""

    @contextmanager
    def __call__(self, rate):
        self.device.host_bit_rate = rate
        yield VirtualPort(EchoingDevice(self.device), self.clock)


@pytest.mark.parametrize(('kind', 'table'), KINDS)
@pytest.mark.parametrize('registers', [{}, {'RETURN_LEVEL': 0}])
def test_an_echo_is_no_servo(kind, table, registers):
    device = make(kind, {getattr(table, name): value for name, value in registers.items()})
    result = EchoingLine(device).set_up()
    assert result.before.found.servo_id == 1
    ready = READY_RX if table is rx else READY_X
    assert values(device, ready) == ready
    assert EchoingLine(device).set_up().changes == []


@pytest.mark.parametrize(('kind', 'table'), KINDS)
def test_servos_behind_an_echo_are_told_apart(kind, table):
    servos = [make(kind, servo_id=servo_id) for servo_id in (3, 7, 1)]
    with pytest.raises(SeveralServosError, match=r' 1, 3, 7;'):
        EchoingLine(SharedBus(servos)).set_up()
    twins = make(kind, pitch=0.3), make(kind, pitch=-0.2, return_delay=0)
    with pytest.raises(SharedIdError, match='two servos have this ID'):
        EchoingLine(SharedBus(twins)).set_up()


def test_an_echo_alone_is_no_servo():
    with pytest.raises(NoServoError):
        EchoingLine(SilentDevice()).set_up()


@pytest.mark.parametrize(('kind', 'table'), KINDS)
def test_of_several_servos_one_is_chosen(kind, table):
    servos = [make(kind, servo_id=servo_id) for servo_id in (3, 7, 1)]
    line = Line(SharedBus(servos))
    with pytest.raises(SeveralServosError, match=r'1, 3, 7;.*--from-id'):
        line.set_up()
    with pytest.raises(SeveralServosError, match='another servo has the ID 1'):
        line.set_up(from_id=7)
    line.set_up(from_id=7, config=replace(ServoConfig(), servo_id=9))
    assert [each.table[table.ID] for each in servos] == [3, 9, 1]
    assert [each.bit_rate == 1_000_000 for each in servos] == [False, True, False]


@given(st.binary(max_size=60), st.sampled_from([PROTOCOL_1, PROTOCOL_2]))
def test_answers_are_found_in_noise_only_if_they_are_sound(noise, packets):
    packet = packets.encode_answer(17, 0)
    quiet = noise.replace(b'\xff', b'')
    found = answers(packets, quiet + packet + quiet)
    assert [(each.servo_id, each.status) for each in found] == [(17, 0)]
    broken = packet[:-1] + bytes([packet[-1] ^ 1])
    assert answers(packets, quiet + broken) == []
    answers(packets, noise)


def test_every_rate_that_a_servo_of_protocol_1_can_have_is_tried():
    tried = [trial.baud_rate for trial in rare_trials()] + list(RATES_1)
    for rate in [*(2_000_000 / (n + 1) for n in range(255)), 2_250_000, 2_500_000, 3_000_000]:
        assert min(abs(each / rate - 1.0) for each in tried) < 0.021, rate


@pytest.mark.parametrize(
    ('kind', 'code', 'rate'), [(XServoEmulator, 7, '4500000'), (RxServoEmulator, 249, '8...')]
)
def test_a_bit_rate_that_the_node_does_not_have_may_not_stay(kind, code, rate):
    line = Line(make(kind, baud=code), yes=lambda question: 'bit rate' not in question)
    with pytest.raises(ParameterError, match=f"'baud_rate' must be between .* but is {rate}"):
        line.set_up()
    line.set_up(dry_run=True)  # says what would be changed


@pytest.mark.parametrize('packets', [PROTOCOL_1, PROTOCOL_2])
def test_a_rate_survives_its_register(packets):
    for rate in (9600, 57_600, 115_200, 1_000_000):
        code = rate_code(packets, rate)
        assert rate_of(packets, code) == pytest.approx(rate, rel=0.03)
    assert rate_code(packets, 300_000_000) is None


def test_the_command_that_starts_the_nod(tmp_path):
    config = ServoConfig(model='XL430-W250')
    assert start_command('/dev/ttyUSB1', config, None) == (
        'ros2 launch nodlidar_bringup robot.launch.py hardware:=real servo:=XL430-W250'
        ' servo_port:=/dev/ttyUSB1'
    )
    assert start_command('p', config, tmp_path / 'a').endswith(f' servo_params:={tmp_path}/a')


def test_the_command_is_shown_with_what_another_lidar_needs(capsys):
    with PseudoTerminals({'servo': make(XServoEmulator)}) as ports:
        assert setup(['--port', ports['servo'], '--yes']) == 0
    [*_, hint, command] = capsys.readouterr().out.splitlines()
    assert 'lidar:=' in hint
    assert command == start_command(ports['servo'], ServoConfig(model='XL430-W250'), None)


def test_a_file_that_cannot_be_written_is_refused_before_the_servo_is_changed(tmp_path, capsys):
    servo = make(XServoEmulator)
    before = values(servo, READY_X)
    with PseudoTerminals({'servo': servo}) as ports:
        path = tmp_path / 'new' / 'servo.yaml'
        options = ['--port', ports['servo'], '--yes', '--limits', '-0.3', '0.3']
        assert setup([*options, '--output', str(path)]) == 1
    assert f"No such file or directory: '{path}'" in capsys.readouterr().err
    assert values(servo, READY_X) == before


@pytest.mark.parametrize(('kind', 'table'), KINDS)
def test_limits_are_turned_with_the_sign_of_the_joint_and_the_file_stays(kind, table, tmp_path):
    """Set up; the sign turns out to be wrong; set up again, and once more without options."""
    path, servo, middle = tmp_path / 'servo.yaml', make(kind), 2048 if table is x else 512
    ends = (table.MIN_POSITION, table.MAX_POSITION) if table is x else (rx.CW_LIMIT, rx.CCW_LIMIT)
    with PseudoTerminals({'servo': servo}) as ports:
        options = ['--port', ports['servo'], '--yes', '--output', str(path)]
        assert setup([*options, '--limits', '-0.3', '0.7']) == 0
        before = file_values([path], 'servo', ServoConfig)
        assert before == {'pitch_lower_limit': -0.3, 'pitch_upper_limit': 0.7}
        upright = list(values(servo, ends).values())
        path.write_text(path.read_text() + '    feedback_rate: 50.0\n')
        for again in (['--invert'], []):
            assert setup([*options, *again]) == 0
            after = file_values([path], 'servo', ServoConfig)
            assert after == {**before, 'invert': True, 'feedback_rate': 50.0}
            turned = [2 * middle - each for each in reversed(upright)]
            assert list(values(servo, ends).values()) == turned
        assert setup([*options, '--no-invert', '--limits', '-0.8', '0.8']) == 0
        assert file_values([path], 'servo', ServoConfig) == {'feedback_rate': 50.0}


def test_a_file_of_something_else_is_not_replaced(tmp_path, capsys):
    path = tmp_path / 'servo.yaml'
    path.write_text('a list: [1, 2]\n')
    with PseudoTerminals({'servo': make(XServoEmulator)}) as ports:
        assert setup(['--port', ports['servo'], '--yes', '--output', str(path)]) == 2
    assert "'a list' must be in a section such as '/**'" in capsys.readouterr().err
    assert path.read_text() == 'a list: [1, 2]\n'


def test_a_lidar_behind_the_port_of_the_servo_is_named():
    clock = HostClock()
    lidar = UrgEmulator(lambda times, azimuth: np.ones(len(times)), start_ns=clock())
    swapped = pytest.raises(LidarError, match='swap the ports')
    with PseudoTerminals({'lidar': lidar}) as ports, swapped:
        check_lidar(Port(ports['lidar']))
    with PseudoTerminals({'servo': make(XServoEmulator)}) as ports:
        check_lidar(Port(ports['servo']))


def test_a_lidar_that_streams_is_no_servo():
    lidar = StreamingLidar(lambda times, _: np.ones(len(times)), start_ns=CLOCK())
    line, begin_ns = Line(lidar), CLOCK()
    with pytest.raises(LidarError, match=r'something streams at this port.*LD19: --port'):
        line.set_up()
    assert CLOCK() - begin_ns < 10**9


def test_what_was_changed_to_let_the_servo_answer_is_shown(capsys):
    device = make(RxServoEmulator, {**READY_RX, rx.RETURN_LEVEL: 0, rx.RETURN_DELAY: 0}, baud=1)
    with PseudoTerminals({'servo': device}) as ports:
        assert setup(['--port', ports['servo'], '--yes']) == 0
    shown = capsys.readouterr().out
    assert 'nothing was changed' not in shown
    assert re.search(r'return level +.* unknown +.* 2 ', shown)


def test_without_changes_the_parameters_are_shown_and_no_command_that_lacks_them(capsys):
    with PseudoTerminals({'servo': make(RxServoEmulator, servo_id=5)}) as ports:
        assert setup(['--port', ports['servo'], '--yes', '--dry-run']) == 0
    shown = capsys.readouterr().out
    assert 'servo_id: 5' in shown
    assert 'ros2 launch' not in shown
