"""How nodes on two machines find each other: the settings of docs/network.md, tried.

A node on the robot publishes small clouds, a node on the other machine listens. Both machines are
network namespaces.
"""

from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
import tempfile
import time

from bench.network.machines import Line, Machines
from bench.network.network import DEFAULT, ENVIRONMENT, LOSSY, profiles
from bench.network.network_listener import arrivals
from bench.network.network_rig import listening, process_at, Site, talking
from bench.shared.report import Row

PATIENCE = 8.0  # s; after it, nodes are not expected to find each other
LINE = Line(delay=0.002)
ROBOT, FAR = '10.77.0.1', '10.77.0.2'
TITLE = 'Time from the start of two nodes on two machines to the first message'
SERVER = f'{ROBOT}:11811'
LOCAL = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}


@dataclass(frozen=True, slots=True)
class Setup:
    """The variables of the environment on the robot and on the other machine."""

    name: str
    robot: dict[str, str]
    far: dict[str, str] = field(default_factory=dict)
    server: bool = False


SETUPS = [
    Setup('as it is: multicast', {}),
    Setup('lossy_network.xml', profiles(LOSSY), profiles(LOSSY)),
    Setup('range LOCALHOST', LOCAL, LOCAL),
    Setup('range LOCALHOST, peers on one machine', LOCAL, LOCAL | {'ROS_STATIC_PEERS': ROBOT}),
    Setup(
        'range LOCALHOST, peers on both machines',
        LOCAL | {'ROS_STATIC_PEERS': FAR},
        LOCAL | {'ROS_STATIC_PEERS': ROBOT},
    ),
    Setup('other domains', {'ROS_DOMAIN_ID': '1'}, {'ROS_DOMAIN_ID': '2'}),
    Setup(
        'discovery server on the robot',
        {'ROS_DISCOVERY_SERVER': SERVER},
        {'ROS_DISCOVERY_SERVER': SERVER},
        server=True,
    ),
]


def results() -> list[Row]:
    """Return the time until the first message, by setting."""
    return [measured(setup) for setup in SETUPS]


def measured(setup: Setup) -> Row:
    """Return the row of a setting."""
    with (
        tempfile.TemporaryDirectory(prefix='network-') as name,
        Machines(LINE) as machines,
        ExitStack() as stack,
    ):
        common = ENVIRONMENT | profiles(DEFAULT)
        robot = Site(machines.robot, common | setup.robot)
        far = Site(machines.far, common | setup.far)
        folder = Path(name)
        if setup.server:
            server = ['fast-discovery-server', '-i', '0', '-l', ROBOT, '-p', '11811']
            own = Site(machines.robot, common)
            stack.enter_context(process_at(own, folder / 'server.log', server))
        topic = 'points=sensor_msgs/msg/PointCloud2'
        stack.enter_context(listening(far, folder / 'there', [topic]))
        stack.enter_context(talking(robot, folder / 'talker.log', 1000, 1000, 0.02, 0.0))
        begin = time.monotonic()
        first = None
        while first is None and time.monotonic() - begin < PATIENCE:
            if any(True for _ in arrivals(folder / 'there')):
                first = time.monotonic() - begin
            time.sleep(0.02)
    return {'setting': setup.name, 'first message [s]': first or 'never'}
