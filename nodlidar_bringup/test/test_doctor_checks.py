"""Each fault put into facts of a healthy sensor is found and named, with what mends it."""

from dataclasses import replace
import math
from pathlib import Path
import re

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_bringup.checks.diagnostics import check_diagnostics, Status
from nodlidar_bringup.checks.finding import Level
from nodlidar_bringup.checks.graph import check_graph, Endpoint, Graph, Topic
from nodlidar_bringup.checks.host import check_host, EARLIEST_NS, Host, REFERENCE
from nodlidar_bringup.checks.network import check_network, Network
from nodlidar_bringup.checks.ports import Answer, check_ports, Port, ServoSettings
from nodlidar_bringup.checks.traffic import (
    check_content,
    check_together,
    check_traffic,
    Content,
    Traffic,
)
from nodlidar_bringup.checks.transforms import check_frames, Frames
from nodlidar_bringup.ros.launch_arguments import ARGUMENTS
from nodlidar_servo.device.config import ServoConfig
import pytest

WORKSPACE = Path(__file__).parents[2]
LIDAR = Port('lidar', '/dev/ttyACM0', usb_id='15d1:0000', answer=Answer('lidar', 'URG-04LX-UG01'))
SERVO = Port(
    'servo',
    '/dev/ttyUSB0',
    usb_id='0403:6014',
    latency_timer=1,
    answer=Answer('servo', 'RX-24F', 1_000_000, 1),
)
HOST = Host(EARLIEST_NS + 1)
RUNNING = replace(HOST, nodes_run=True)
NODES = ('/driver', '/servo', '/assembler', '/robot_state_publisher')
TOPICS = {
    'scan': Topic('scan', (Endpoint('/driver'),), (Endpoint('/assembler'),), ('LaserScan',)),
    'joint_states': Topic('joint_states', (Endpoint('/servo'),), (), ('JointState',)),
    'points': Topic('points', (Endpoint('/assembler'),), (), ('PointCloud2',)),
}
AGES = [0.11] * 40
SCANS = Traffic('scan', 4.0, AGES, [0.1] * 39, frames=frozenset({'laser'}))
JOINTS = Traffic('joint_states', 4.0, [0.01] * 400, [0.01] * 399)
CLOUDS = Traffic('points', 12.2, [6.2] * 2, [6.1], lasts=6.1)  # of an LD19's sweeps
CONTENT = Content(0.9, 'nod_joint', frozenset({'nod_joint'}), [-0.6, 0.0, 0.6])
PARENTS = {
    'nodlidar_base_link': frozenset({'base_link'}),
    'nodlidar_tilt_link': frozenset({'nodlidar_base_link'}),
    'laser': frozenset({'nodlidar_tilt_link'}),
}
FRAMES = Frames(
    PARENTS,
    scan_frames=frozenset({'laser'}),
    lever=(0.0, 0.0, 0.08),
    assembler_lever=(0.0, 0.0, 0.08),
)


def ports(lidar=None, servo=None, **settings):
    return check_ports(
        replace(LIDAR, **lidar or {}),
        replace(SERVO, **servo or {}),
        ServoSettings(**settings),
    )


def graph(nodes=NODES, on_sim_time=(), clock=False, **topics):
    return check_graph(Graph(nodes, tuple((TOPICS | topics).values()), on_sim_time, clock))


def answer(**changes):
    return {'answer': replace(SERVO.answer, **changes)}


def without(frame):
    return {name: parents for name, parents in PARENTS.items() if name != frame}


@pytest.mark.parametrize(
    'findings',
    [
        ports(),
        ports({'users': ('driver (process 7)',), 'own': True, 'answer': None}),
        check_host(HOST),
        check_host(RUNNING),
        check_host(replace(HOST, synchronised=None)),
        check_host(replace(HOST, governor='powersave', frequency_driver='intel_pstate')),
        check_host(replace(HOST, governor='powersave', frequency_driver='amd-pstate-epp')),
        check_network(Network()),
        check_network(Network('42', 'LOCALHOST', 'rmw_fastrtps_cpp')),
        graph(),
        graph(on_sim_time=('/driver',), clock=True),
        check_traffic(SCANS),
        check_frames(
            replace(FRAMES, parents=without('nodlidar_tilt_link'), joints_come=False)
        ),  # what follows from a silent servo
        check_together(SCANS, JOINTS, 0.3),
        check_together(SCANS, replace(JOINTS, ages=[0.4] * 400), 0.3),
        check_together(SCANS, replace(JOINTS, ages=()), 0.3),
        check_traffic(CLOUDS),
        check_traffic(replace(CLOUDS, seconds=4.0, ages=(), steps=())),
        check_content(CONTENT),
        check_frames(FRAMES),
        check_diagnostics((Status('driver: device', 0, 'connected'),)),
    ],
)
def test_a_healthy_sensor_has_no_fault(findings):
    assert all(finding.level < Level.WARNING for finding in findings), findings


FAILED = 'of the replies failed'
MODEL_MISSING = 'transform missing', 'robot_state_publisher'
FAULTS = [
    # what was put in, what is found, a part of what mends it
    (ports({'exists': False}), 'port missing', 'lidar_port:='),
    (ports(servo={'exists': False}), 'port missing', 'servo_port:='),
    (ports({'may_use': False}), 'no rights', 'usermod -aG dialout'),
    (ports({'may_use': False, 'group': 'uucp'}), 'no rights', 'usermod -aG uucp'),
    (ports({'users': ('minicom (process 7)',)}), 'port in use', 'fuser -v /dev/ttyACM0'),
    (ports({'path': '/dev/ttyUSB0'}), 'one port for both', 'servo_port:='),
    (
        ports({'usb_id': '0403:6014', 'answer': None}, {'usb_id': '15d1:0000', 'answer': None}),
        'ports swapped',
        'lidar_port:=/dev/ttyUSB0 servo_port:=/dev/ttyACM0',
    ),
    (ports({'answer': SERVO.answer}, {'answer': LIDAR.answer}), 'ports swapped', 'servo_port:='),
    (ports({'answer': SERVO.answer}), 'wrong device', 'lidar_port:='),
    (ports(servo={'latency_timer': 16}), 'latency timer', 'install_udev_rules'),
    (
        ports(servo=answer(baud_rate=57_600)),
        'wrong bit rate',
        'setup --port /dev/ttyUSB0',
    ),
    (ports(servo=answer(servo_id=7)), 'wrong ID', 'nodlidar_servo setup'),
    (ports(servo=answer(wrong_mode='in wheel mode')), 'wheel mode', 'nodlidar_servo setup'),
    (ports(servo={'answer': Answer()}), 'no answer', 'supply'),
    (ports({'answer': Answer()}), 'no answer', 'USB cable'),
    (check_host(replace(HOST, now_ns=10**18)), 'clock never set', 'set-ntp true'),
    (check_host(replace(HOST, clock_step=-0.5)), 'clock steps', 'chrony'),
    (check_host(replace(HOST, synchronised=False)), 'clock not synchronised', 'set-ntp true'),
    (check_host(replace(HOST, cores=1, yardstick=5 * REFERENCE)), 'processor too slow', 'fast'),
    (check_host(replace(HOST, cores=2, busy=0.9)), 'processor busy', 'profile:=fast'),
    (check_host(replace(RUNNING, busy=0.95)), 'processor busy', 'profile:=fast'),
    (check_host(replace(HOST, governor='powersave')), 'power saving', 'cpupower'),
    (
        check_host(replace(HOST, governor='powersave', frequency_driver='intel_cpufreq')),
        'power saving',
        'cpupower',
    ),
    (check_network(Network('250')), 'domain', 'ROS_DOMAIN_ID=0'),
    (check_network(Network('mine')), 'domain', 'ROS_DOMAIN_ID=0'),
    (check_network(Network('120')), 'domain', 'ROS_DOMAIN_ID=0'),
    (check_network(Network(discovery_range='OFF')), 'discovery', '=LOCALHOST'),
    (check_network(Network(discovery_range='local')), 'discovery', '=LOCALHOST'),
    (check_network(Network(localhost_only=True)), 'discovery', 'unset'),
    (check_network(Network(middleware='rmw_zenoh_cpp')), 'middleware', '-rmw-zenoh-cpp'),
    (check_network(Network(profiles_file='a', profiles_exist=False)), 'profiles', 'unset'),
    (check_network(Network(shared_memory=1e6)), 'shared memory', '--shm-size'),
    (graph((*NODES, '/servo')), 'two nodes of one name', 'namespace:='),
    (graph(on_sim_time=('/driver',)), 'no simulated time', 'set /driver use_sim_time false'),
    (graph(points=Topic('points')), 'no publisher', 'robot.launch.py'),
    (graph(scan=Topic('scan')), 'no publisher', 'with lidar:=... start that driver yourself'),
    (graph(NODES[1:], scan=Topic('scan')), 'no publisher', 'end the launch that runs (Ctrl-C)'),
    (
        check_graph(Graph(NODES, tuple(TOPICS.values()), mute=('/servo',))),
        'node hangs',
        'end the launch that runs (Ctrl-C)',
    ),
    (
        check_graph(Graph(NODES, tuple(TOPICS.values()), inactive={'/driver': False})),
        'node not active',
        'lifecycle set /driver activate',
    ),
    (
        check_graph(Graph(NODES, tuple(TOPICS.values()), inactive={'/servo': True})),
        'node not active',
        'end the launch that runs (Ctrl-C)',
    ),
    (
        graph(scan=Topic('scan', (Endpoint('/driver'), Endpoint('/urg_node2')))),
        'two publishers',
        'topic info -v /scan;',
    ),
    (
        graph(scan=replace(TOPICS['scan'], publishers=(Endpoint('/ld19', reliable=False),))),
        'quality of service',
        'qos_overrides./scan.subscription.reliability: best_effort',
    ),
    (
        graph(points=replace(TOPICS['points'], subscriptions=(Endpoint('/map', True, True),))),
        'quality of service',
        'set qos_overrides./points.subscription.durability: volatile in the parameters of /map',
    ),
    (
        graph(scan=replace(TOPICS['scan'], types=('A', 'B'))),
        'types differ',
        'topic info -v /scan; remap',
    ),
    (check_traffic(replace(SCANS, ages=())), 'silent topic', '/diagnostics'),
    (check_traffic(replace(SCANS, ages=AGES[:8])), 'low rate', 'profile:=fast'),
    (check_traffic(replace(SCANS, ages=[-3.0] * 40)), 'stamps in the future', 'chrony'),
    (check_traffic(replace(SCANS, ages=[500.0] * 40)), 'stamps in the past', 'chrony'),
    (check_traffic(replace(CLOUDS, ages=())), 'silent topic', '/diagnostics'),
    (check_traffic(replace(CLOUDS, seconds=24.4)), 'low rate', 'profile:=fast'),
    (check_traffic(replace(CLOUDS, ages=[9.0] * 2)), 'stamps in the past', 'chrony'),
    (
        check_together(SCANS, replace(JOINTS, ages=[0.42] * 400), 0.3),
        'joint states late',
        'by the clock that stamps the scans',
    ),
    (check_traffic(replace(SCANS, steps=[0.1, -0.1])), 'stamps go back', 'topic info -v /scan'),
    (check_traffic(replace(SCANS, ages=(), unstamped=40)), 'no stamp', 'stamps each message'),
    (check_content(replace(CONTENT, valid_share=0.0)), 'lidar sees nothing', 'window'),
    (
        check_content(replace(CONTENT, joint_names=frozenset({'left_nod_joint'}))),
        'joint missing',
        'frame_prefix:=',
    ),
    (check_content(replace(CONTENT, positions=[0.1, 0.11])), 'joint stands still', 'supply'),
    (
        check_content(replace(CONTENT, positions=[0.1, 0.11], followed=False)),
        'joint stands still',
        'end the launch that runs (Ctrl-C)',
    ),
    (check_content(replace(CONTENT, positions=[math.nan])), 'no joint position', 'order of the'),
    (check_frames(replace(FRAMES, parents=without('laser'))), 'transform missing', 'model'),
    (check_frames(Frames()), *MODEL_MISSING),
    (check_frames(replace(FRAMES, parents=without('nodlidar_tilt_link'))), *MODEL_MISSING),
    (
        check_frames(replace(FRAMES, parents=PARENTS | {'laser': frozenset({'a', 'b'})})),
        'two parents',
        'frame_prefix:=',
    ),
    (
        check_frames(replace(FRAMES, parents=PARENTS | {'laser': frozenset({'base_link'})})),
        'wrong parent',
        'robot.launch.py',
    ),
    (
        check_frames(replace(FRAMES, scan_frames=frozenset({'urg'}))),
        'unknown frame',
        "frame_id to 'laser'",
    ),
    (
        check_frames(replace(FRAMES, lever=(0.01, 0.0, 0.05))),
        'lever arms differ',
        'laser_xyz:="0.01 0 0.05"',
    ),
    (
        check_diagnostics((Status('servo', 2, 'supply is 4.4 V, outside 4.5 to 6.0 V'),)),
        'reported',
        'what its model needs',
    ),
    (
        check_diagnostics((Status('servo', 2, 'in multi-turn mode: set its angle limits'),)),
        'reported',
        'nodlidar_servo setup',
    ),
    (
        check_diagnostics((Status('servo', 2, 'the servo has shut down (overload)'),)),
        'reported',
        'what blocks the nod',
    ),
    (
        check_diagnostics((Status('servo', 1, f'{FAILED}: late reply; 1% {FAILED}: no answer'),)),
        'reported',
        'end other programs',
    ),
    (
        check_diagnostics((Status('servo', 1, f'{FAILED}: no answer; 1% {FAILED}: late reply'),)),
        'reported',
        'check supply, cable',
    ),
    (check_diagnostics((Status('driver', 1, 'no scan for 3 s'),)), 'reported', 'faults.md'),
    *(
        (check_diagnostics((Status('assembler: clouds', 1, words),)), 'reported', remedy)
        for words, remedy in (
            ('up and down sweeps disagree: joint_delay is off by 8 ms', 'calibrate live'),
            ("2 publishers of 'scan': stop all but one", 'topic info -v'),
            ('2 publishers on /scan: stop all but one', 'topic info -v'),
            ('the lidar sent nothing for 0.5 s', 'check supply, cable'),
            ('odometry is stamped 0.40 s in the future', 'chrony'),
            ('no range for 4 s: is the lidar covered?', 'probe'),
        )
    ),
]


@pytest.mark.parametrize(('findings', 'check', 'remedy'), FAULTS)
def test_a_fault_is_named_with_what_mends_it(findings, check, remedy):
    found = [finding for finding in findings if finding.level >= Level.WARNING]
    assert check in {finding.check for finding in found}, findings
    assert any(remedy in finding.remedy for finding in found if finding.check == check), found
    assert all(finding.text and finding.remedy for finding in found)


def test_advice_about_a_sensor_in_a_namespace_names_its_topics():
    scan = Topic(
        'scan',
        (Endpoint('/left/driver', reliable=False), Endpoint('/left/urg_node2')),
        (Endpoint('/map', transient_local=True),),
        ('A', 'B'),
    )
    findings = [
        *check_graph(Graph(('/left/driver',), (scan,), namespace='/left')),
        *check_traffic(replace(SCANS, steps=[0.1, -0.1], namespace='/left')),
        *check_content(replace(CONTENT, positions=[0.1, 0.11], namespace='/left')),
    ]
    remedies = ' ; '.join(finding.remedy for finding in findings)
    assert 'set qos_overrides./left/scan.subscription.reliability: best_effort and ' in remedies
    assert 'and qos_overrides./left/scan.subscription.durability: volatile in' in remedies
    named = re.findall(r'ros2 topic (?:info -v|echo --once) ([\w/]+)', remedies)
    assert set(named) == {'/left/scan', '/left/servo/status'}


def test_a_sensor_in_another_namespace_is_named():
    nodes = ('/robot/left/assembler', '/robot/left/driver', '/camera/driver')
    (found,) = check_graph(Graph(nodes))
    assert "in the namespace '/', but in '/robot/left'" in found.text
    assert found.remedy == 'ros2 run nodlidar_bringup doctor --namespace /robot/left'
    (found,) = check_graph(Graph(('/assembler',), namespace='/left'))
    assert found.remedy == 'ros2 run nodlidar_bringup doctor --namespace /'
    (found,) = check_graph(Graph(('/camera/driver',)))
    assert 'in this ROS domain' in found.text


def test_of_all_diagnostics_those_of_the_sensor_count():
    others = ('battery_monitor: battery', 'right/mapper: map', 'left/camera: device', 'driver: x')
    names = (*others, 'left/mapper: map', 'left/driver: device')
    statuses = tuple(Status(name, 2, 'broken') for name in names)
    found = check_diagnostics(statuses, '/left')
    assert [each.text for each in found] == [f'{name}: broken' for name in names[-2:]]
    [found] = check_diagnostics(statuses)
    assert found.text == 'driver: x: broken'
    [found] = check_diagnostics(statuses[:1])
    assert found.level == Level.UNKNOWN


def test_swapped_ports_are_not_reported_as_other_faults():
    [found] = ports({'answer': SERVO.answer}, {'answer': LIDAR.answer})
    assert found.check == 'ports swapped'


def test_what_mends_a_fault_exists():
    """Commands of this workspace, launch arguments and parameters that remedies name."""
    remedies = ' ; '.join(
        finding.remedy for findings, *_ in FAULTS for finding in findings if finding.remedy
    )
    for package, command in set(re.findall(r'ros2 run (nodlidar_\w+) (\w+)', remedies)):
        setup = (WORKSPACE / package / 'setup.py').read_text()
        assert f"'{command} = " in setup
    assert set(re.findall(r'(\w+):=', remedies)) <= ARGUMENTS.keys()
    parameters = ServoConfig.__dataclass_fields__.keys() | AssemblerConfig.__dataclass_fields__
    assert set(re.findall(r'set (\w+): ', remedies)) <= parameters
    for page in re.findall(r'docs/\w+\.md', remedies):
        assert (WORKSPACE / page).exists()


def test_more_than_twenty_faults_are_told_apart():
    assert len({check for _, check, _ in FAULTS}) >= 30


def test_the_table_of_faults_names_a_test_for_each():
    page = (WORKSPACE / 'docs' / 'faults.md').read_text()
    table = page.partition('## Faults of the set-up')[2]
    rows = re.findall(
        r'^\| (?!fault|---)([^|]+)\|.*`(test_\w+)`, `(\w+)` \|$', table, re.MULTILINE
    )
    assert len({fault for fault, *_ in rows}) >= 20
    for _, file, name in rows:
        [path] = WORKSPACE.glob(f'nodlidar_*/test/{file}.py')
        assert f'def {name}(' in path.read_text(), (file, name)


def test_ports_that_nobody_named_may_be_absent():
    [lidar, *_] = ports({'exists': False, 'chosen': False})
    assert lidar.level == Level.UNKNOWN


def test_without_a_running_system_the_rest_is_not_checked():
    [finding] = check_graph(Graph(('/left/driver', '/rviz')))  # another sensor's driver
    assert finding.level == Level.UNKNOWN
    assert 'robot.launch.py' in finding.remedy
