"""The speed of assemble_bag against real time, the shares of its steps, and its memory.

Times are of one core, the lower quartile of interleaved runs. The time of a step is the time with
it, less the time without it.
"""

from functools import partial
from pathlib import Path
import subprocess
import sys
from tempfile import TemporaryDirectory
from typing import Any

from nodlidar_assembler.bags.bag_replay import BagReplay
from nodlidar_assembler.bags.bag_source import BagSource
from nodlidar_assembler.bags.bag_tf import BagTf
from nodlidar_assembler.bags.bag_topics import Topics
from nodlidar_assembler.bags.sensor_log import assemble_log
from nodlidar_assembler.bags.write_clouds import write_clouds
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.bag_messages import JOINT_STATE, SCAN, TF
from nodlidar_demo.simulated_log import simulated_log
from nodlidar_sim.bag import write_bag
from nodlidar_sim.simulation import Recording
from nodlidar_sim.world.sensor_model import SensorModel
from rosbags.rosbag2 import Reader, StoragePlugin

from bench.shared.reference import DRIVING, simulated_room
from bench.shared.report import Row
from bench.shared.timing import Action, interleaved

DURATION = 60.0
LONGER = 8  # times as long: a second bag, which must not need more memory
JOINT_RATE = 100.0
ROUNDS = 9
TITLE = (
    f'assemble_bag: {DURATION:.0f} s of 10 scans and {JOINT_RATE:.0f} joint states a second, '
    'odometry at 50 Hz'
)
MEASURED = """
import sys
from nodlidar_assembler.commands.entry_points import assemble_bag
assert assemble_bag(sys.argv[1:]) == 0
[peak] = [line for line in open('/proc/self/status') if line.startswith('VmHWM')]
print(peak.split()[1])
"""


def results() -> list[Row]:
    """Return speed, shares of the time and memory by bag and output."""
    with TemporaryDirectory() as folder:
        return _results(Path(folder))


def _results(folder: Path) -> list[Row]:
    simulated = _recording(DURATION)
    mcap, sqlite = folder / 'mcap', folder / 'sqlite'
    write_bag(simulated, mcap)
    write_bag(simulated, sqlite, StoragePlugin.SQLITE3)
    longer = folder / 'longer'
    write_bag(_recording(LONGER * DURATION), longer)
    rows = [from_arrays(simulated)]
    for bag, name, config in (
        (mcap, 'out.ply', AssemblerConfig()),
        (mcap, 'out.pcd', AssemblerConfig()),
        (mcap, 'out.mcap', AssemblerConfig()),
        (sqlite, 'out.ply', AssemblerConfig()),
        (mcap, 'out.ply', AssemblerConfig(ego_motion='beam')),
        (mcap, 'out.ply', AssemblerConfig(estimator='trajectory')),
    ):
        rows.append(from_bag(bag, folder / name, config))
    short, long = (peak_memory(bag, folder / 'out.ply') for bag in (mcap, longer))
    rows[1] |= {'memory [MB]': short, f'{LONGER} x as long [MB]': long}
    return rows


def _recording(duration: float) -> Recording:
    return simulated_room(duration, sensor=SensorModel(joint_rate=JOINT_RATE), velocity=DRIVING)


def from_arrays(simulated: Recording) -> Row:
    """Return the speed from arrays to points."""
    log = simulated_log(simulated)
    action = partial(_assembled, log)
    [(seconds, _)] = interleaved({'arrays': action}, ROUNDS)
    return _row('arrays to points', seconds, action())


def _assembled(log: Any) -> int:
    clouds, _ = assemble_log(log, AssemblerConfig())
    return sum(len(cloud.data) for cloud in clouds)


def from_bag(bag: Path, output: Path, config: AssemblerConfig) -> Row:
    """Return the speed from a bag to a file, and the shares of the steps."""
    steps: dict[str, Action] = {
        'read [%]': partial(_read, bag, config),
        'decode [%]': partial(_decode, bag, config),
        'assemble [%]': partial(_assemble, bag, config),
        'write [%]': partial(write_clouds, bag, output, config, Topics()),
    }
    times = [own for own, _ in interleaved(steps, ROUNDS)]
    points = write_clouds(bag, output, config, Topics()).counts['points']
    what = [f'{bag.name} to {output.suffix[1:]}']
    what += ['odometry'] if config.ego_motion != 'off' else []
    what += [config.estimator] if config.estimator != AssemblerConfig().estimator else []
    row = _row(', '.join(what), times[-1], points)
    for name, before, after in zip(steps, [0.0, *times], times, strict=False):
        row[name] = 100.0 * (after - before) / times[-1]
    return row


def _row(what: str, seconds: float, points: Any) -> Row:
    return {
        'what': what,
        'times real time': DURATION / seconds,
        'points [1e6/s]': points / seconds / 1e6,
    }


def _wanted(config: AssemblerConfig) -> dict[str, str]:
    wanted = {'/scan': SCAN, '/joint_states': JOINT_STATE}
    return wanted if config.ego_motion == 'off' else {**wanted, '/tf': TF}


def _read(bag: Path, config: AssemblerConfig) -> None:
    wanted = _wanted(config)
    with Reader(bag) as reader:
        chosen = [each for each in reader.connections if each.topic in wanted]
        for _ in reader.messages(chosen):
            pass


def _decode(bag: Path, config: AssemblerConfig) -> None:
    with BagSource(bag) as source:
        for _ in source.messages(_wanted(config)):
            pass


def _assemble(bag: Path, config: AssemblerConfig) -> None:
    wanted = _wanted(config)
    with BagSource(bag) as source:
        static = (each.message for each in source.messages({'/tf_static': TF}))
        tf = BagTf(config.odom_frame, config.frame_id, static)
        replay = BagReplay(config, lambda *cloud: None, None if config.ego_motion == 'off' else tf)
        for recorded in source.messages(wanted):
            replay.add(recorded)


def peak_memory(bag: Path, output: Path) -> float:
    """Return the peak memory of the command [MB]."""
    command = [sys.executable, '-c', MEASURED, str(bag), str(output)]
    output_text = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
    return int(output_text.splitlines()[-1]) * 1024 / 1e6
