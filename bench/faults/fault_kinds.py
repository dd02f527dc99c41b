"""The kinds of faults: how each begins and ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
import signal

from nodlidar_sim.devices.faulty_line import FaultyLine
from nodlidar_sim.devices.rx_table import TORQUE_LIMIT
import numpy as np

from bench.faults.fault_rig import Rig

Random = np.random.Generator
NODES = ('driver', 'servo', 'assembler')
_LEAST_RATE, _GREATEST_RATE = 5e-4, 1e-2  # of bytes


@dataclass(frozen=True, slots=True)
class Begun:
    """A fault under way: how it is ended, and when it first had an effect [ns], if it had any."""

    end: Callable[[], None]
    hit_ns: Callable[[], int | None]
    detail: str = ''


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of fault.

    Attributes
    ----------
    name
        Of the kind.
    begin
        Causes one.
    durations
        Shortest and longest [s].
    ends_launch
        Whether the launch ends with it and is started again.
    releases_after
        Torque must go off if it lasts this long [s].
    """

    name: str
    begin: Callable[[Rig, Random], Begun]
    durations: tuple[float, float] = (2.0, 5.0)
    ends_launch: bool = False
    releases_after: float = math.inf


def _rate(rng: Random) -> float:
    low, high = math.log(_LEAST_RATE), math.log(_GREATEST_RATE)
    return float(math.exp(rng.uniform(low, high)))


def _lost(line: FaultyLine, rng: Random) -> str:
    line.drop_rate = _rate(rng)
    return f'{line.drop_rate:.2%}'


def _changed(line: FaultyLine, rng: Random) -> str:
    line.corrupt_rate = _rate(rng)
    return f'{line.corrupt_rate:.2%}'


def _swapped(line: FaultyLine, rng: Random) -> str:
    line.swap_rate = _rate(rng)
    return f'{line.swap_rate:.2%}'


def _inserted(line: FaultyLine, rng: Random) -> str:
    line.insert_rate = _rate(rng)
    return f'{line.insert_rate:.2%}'


def _silent(line: FaultyLine, rng: Random) -> str:
    line.mute = True
    return ''


def _delayed(line: FaultyLine, rng: Random) -> str:
    line.delay_ns = 300_000_000
    return '300 ms'


def _jittery(line: FaultyLine, rng: Random) -> str:
    line.jitter_ns = int(rng.integers(5, 60)) * 1_000_000
    return f'up to {line.jitter_ns // 1_000_000} ms'


def _on_wire(device: str, direction: str, spoil: Callable[[FaultyLine, Random], str]) -> Kind:
    words = spoil.__name__.removeprefix('_')

    def begin(rig: Rig, rng: Random) -> Begun:
        line = rig.line(device, direction)
        # The host sends requests to the lidar only when it has opened the port.
        replug = (device, direction) == ('lidar', 'to')
        if replug:
            rig.unplug(device)
        detail = spoil(line, rng)
        if replug:
            rig.recorder.spin(0.2)
            rig.plug_in(device)
        return Begun(line.mend, lambda: line.first_hit_ns, detail)

    return Kind(f'{device}: bytes {direction} it {words}', begin)


def _unplugged(device: str) -> Kind:
    def begin(rig: Rig, rng: Random) -> Begun:
        now_ns = rig.now_ns()
        rig.unplug(device)
        return Begun(lambda: rig.plug_in(device), lambda: now_ns)

    return Kind(f'{device}: unplugged', begin, (0.3, 5.0))


def _restarted(rig: Rig, rng: Random) -> Begun:
    now_ns = rig.now_ns()
    rig.unplug('lidar')
    rig.renew_lidar()
    return Begun(lambda: rig.plug_in('lidar'), lambda: now_ns)


def _wrong_timestamp(rig: Rig, rng: Random) -> Begun:
    rig.timer_hit_ns = None
    rig.timer_error = int(rng.choice([-1, 1]) * rng.integers(5, 60))
    return Begun(lambda: None, lambda: rig.timer_hit_ns, f'{rig.timer_error} ms')


def _of_servo(name: str, spoil: Callable[[Rig, Random], str]) -> Kind:
    def begin(rig: Rig, rng: Random) -> Begun:
        detail = spoil(rig, rng)
        return Begun(rig.motion.mend, lambda: rig.motion.first_hit_ns, detail)

    return Kind(f'servo: {name}', begin)


def _block(rig: Rig, rng: Random) -> str:
    rig.motion.blocked = True
    return ''


def _freeze(rig: Rig, rng: Random) -> str:
    now = np.array([rig.now_ns()])
    rig.motion.frozen = float(rig.motion.position(now)[0])
    return ''


def _spike(rig: Rig, rng: Random) -> str:
    rig.motion.spike_rate = float(rng.uniform(0.005, 0.05))
    return f'{rig.motion.spike_rate:.1%}'


def _without_torque(rig: Rig, rng: Random) -> Begun:
    now_ns, limit = rig.now_ns(), rig.servo.table[TORQUE_LIMIT]
    rig.servo.table[TORQUE_LIMIT] = 0

    def end() -> None:
        rig.servo.table[TORQUE_LIMIT] = limit

    return Begun(end, lambda: now_ns)


def _stopped(node: str) -> Kind:
    def begin(rig: Rig, rng: Random) -> Begun:
        now_ns, process = rig.now_ns(), rig.nodes()[node]
        process.suspend()
        return Begun(process.resume, lambda: now_ns)

    releases_after = 1.5 if node == 'assembler' else math.inf  # it commands
    return Kind(f'{node}: stopped, continued', begin, (0.2, 9.0), releases_after=releases_after)


def _ended(node: str, number: signal.Signals) -> Kind:
    def begin(rig: Rig, rng: Random) -> Begun:
        nodes, now_ns = rig.nodes(), rig.now_ns()
        process = rig.launch.process if node == 'launch' else nodes[node]
        process.send_signal(number)
        return Begun(rig.start_again, lambda: now_ns)

    return Kind(f'{node}: {number.name}', begin, (4.0, 4.0), ends_launch=True, releases_after=0.0)


def _all_kinds() -> list[Kind]:
    damages = (_lost, _changed, _swapped, _inserted, _silent)
    late = (_delayed, _jittery)
    return [
        *(_on_wire('lidar', 'from', spoil) for spoil in damages + late),
        *(_on_wire('lidar', 'to', spoil) for spoil in damages),
        *(_on_wire('servo', 'from', spoil) for spoil in damages + late),
        *(_on_wire('servo', 'to', spoil) for spoil in damages + late),
        _unplugged('lidar'),
        _unplugged('servo'),
        Kind('lidar: restarted', _restarted, (0.5, 3.0)),
        Kind('lidar: one wrong timestamp', _wrong_timestamp, (0.5, 0.5)),
        _of_servo('blocked', _block),
        _of_servo('frozen encoder', _freeze),
        _of_servo('spikes of position', _spike),
        Kind('servo: torque limit reset', _without_torque),
        *(_stopped(node) for node in NODES),
        *(_ended(n, s) for n in NODES for s in (signal.SIGKILL, signal.SIGTERM)),
        _ended('launch', signal.SIGKILL),
    ]


KINDS = {kind.name: kind for kind in _all_kinds()}


def schedule(seed: int, only: str = '') -> list[Kind]:
    """Return the kinds with one of the parts of `only` in their names, in a random order.

    Those that end the launch come last.

    Raises
    ------
    ValueError
        If there are none.
    """
    wanted = [k for name, k in KINDS.items() if any(part in name for part in only.split(','))]
    if not wanted:
        raise ValueError(f"no fault has '{only}' in its name; there are {', '.join(KINDS)}")
    np.random.default_rng(seed).shuffle(wanted)  # type: ignore[arg-type]
    return sorted(wanted, key=lambda kind: kind.ends_launch)
