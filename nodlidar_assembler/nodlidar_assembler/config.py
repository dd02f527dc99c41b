"""The parameters of the assembler node."""

from dataclasses import dataclass

from nodlidar_assembler.clouds.pitch_estimator import ESTIMATORS, JOINT_STEP, LEG_MARGIN
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_planner.task import Task

NOD_MODES = ('coprime', 'feedback', 'interlaced')
LEAST_SPAN = 1e-6  # of the nod [rad]
CLOUD_MODES = ('scan', 'sweep')
EGO_MOTION_MODES = ('off', 'beam')
FALLBACKS = ('drop', 'uncompensated')


@dataclass(frozen=True, slots=True)
class AssemblerConfig:
    """See each field's description; `ros2 param describe` shows the same."""

    joint_name: str = parameter('nod_joint', 'Joint whose position is the pitch of the scan plane')
    joint_positive: str = parameter(
        'up',
        'Where the joint turns the beams as its position rises: up (axis 0 -1 0, as in '
        'nodlidar_bringup) or down (axis 0 1 0, as on many tilting lidars)',
        choices=('up', 'down'),
    )
    joint_zero: float = parameter(
        0.0, 'Position of the joint at pitch 0', unit='rad', minimum=-10.0, maximum=10.0
    )
    joint_delay: float = parameter(
        0.0,
        'How much later than the measurement the stamps of joint states are',
        unit='s',
        minimum=-1.0,
        maximum=1.0,
    )
    scan_delay: float = parameter(
        0.0,
        'How much later than their first beam the stamps of scans are',
        unit='s',
        minimum=-1.0,
        maximum=1.0,
    )
    time_increment: float = parameter(
        0.0,
        'Time between beams where scans tell none; 0: all beams of a scan are of one instant',
        unit='s',
        minimum=0.0,
        maximum=1.0,
    )
    max_range: float = parameter(
        0.0,
        'Ranges beyond it count as nothing; with 0 only those that the scan calls too far do',
        unit='m',
        minimum=0.0,
        maximum=1e6,
    )
    frame_id: str = parameter(
        'nodlidar_base_link', 'Frame of the clouds: fixed, origin on the nod axis, x forward, z up'
    )
    estimator: str = parameter(
        'slerp',
        'How the pitch of a beam is told from joint samples: nearest (one per scan, fast), ends '
        '(two per scan), slerp (every beam between its neighbouring samples) or trajectory (legs '
        'of constant speed fitted to the samples around the scan, slerp where that fails)',
        choices=ESTIMATORS,
    )
    leg_margin: float = parameter(
        LEG_MARGIN,
        'How long before and after a scan joint samples are fitted by trajectory; clouds come '
        'later by as much, or by the deadline where that is less',
        unit='s',
        minimum=0.0,
        maximum=2.0,
    )
    joint_step: float = parameter(
        JOINT_STEP,
        "Step of the joint's encoder: a sample farther from the fitted trajectory refutes it",
        unit='rad',
        minimum=1e-6,
        maximum=0.1,
    )
    cloud_mode: str = parameter(
        'scan', 'One cloud per scan, or per sweep (cut at the turn-around)', choices=CLOUD_MODES
    )
    sweeps_per_cloud: int = parameter(
        1,
        'With clouds per sweep, how many sweeps make one: four to eight, compensated, are what '
        'programs that match clouds need; none lasts longer than 30 s',
        minimum=1,
        maximum=100,
    )
    laser_xyz: tuple[float, float, float] = parameter(
        (0.0, 0.0, 0.080), 'Optical centre of the lidar in the nodding frame', unit='m'
    )
    laser_rpy: tuple[float, float, float] = parameter(
        (0.0, 0.0, 0.0), 'Roll, pitch, yaw of the lidar in the nodding frame', unit='rad'
    )
    max_joint_gap: float = parameter(
        0.1,
        'Longest time between joint samples that is interpolated over',
        unit='s',
        minimum=0.001,
        maximum=10.0,
    )
    deadline: float = parameter(
        0.3,
        'Longest time that a scan waits for the joint samples that bracket it, and then for the '
        'odometry',
        unit='s',
        minimum=0.001,
        maximum=10.0,
    )
    ego_motion: str = parameter(
        'off',
        'beam: every beam starts from where odometry, by TF, says that the robot was at its '
        'instant; clouds are in odom_frame',
        choices=EGO_MOTION_MODES,
    )
    time_in_compensated_clouds: bool = parameter(
        False,
        'Whether clouds in odom_frame have the field time all the same; a program that knows it '
        'may compensate the motion once more',
    )
    odom_frame: str = parameter(
        'odom', 'Frame of odometry, in which TF tells the pose of frame_id'
    )
    without_odometry: str = parameter(
        'drop',
        'What becomes of a scan whose motion odometry does not tell: drop, or uncompensated (its '
        'cloud is in frame_id, as with ego_motion off; not with clouds per sweep)',
        choices=FALLBACKS,
    )
    max_odometry_gap: float = parameter(
        0.2,
        'Longest time between odometry samples that is interpolated over',
        unit='s',
        minimum=0.001,
        maximum=10.0,
    )
    max_robot_speed: float = parameter(
        5.0,
        'Odometry that moves faster between two samples jumps, and is not used',
        unit='m/s',
        minimum=0.01,
        maximum=100.0,
    )
    max_robot_turn_rate: float = parameter(
        10.0,
        'Odometry that turns faster between two samples jumps, and is not used',
        unit='rad/s',
        minimum=0.01,
        maximum=100.0,
    )
    command_nod: bool = parameter(True, 'Command the nod; otherwise only assemble')
    pitch_min: float = parameter(
        -0.6136, 'Lower limit of the nod', unit='rad', minimum=-1.6, maximum=1.6
    )
    pitch_max: float = parameter(
        0.6136, 'Upper limit of the nod', unit='rad', minimum=-1.6, maximum=1.6
    )
    samples_per_sweep: int = parameter(
        4001,
        'N_s: lidar steps, dark ones counted, in one sweep; coprime with steps_per_revolution',
        minimum=1,
        maximum=10_000_000,
    )
    steps_per_revolution: int = parameter(
        1024,
        'N_L: lidar steps in a whole revolution, dark ones counted',
        minimum=1,
        maximum=65_536,
    )
    nod_mode: str = parameter(
        'coprime',
        'coprime: the planned nod, its phase tied to the lidar; feedback: every sweep is a little '
        'longer or shorter than planned, so that beams fall where none has been yet; interlaced: '
        'slow sweeps up, of samples_per_sweep at most, between each other, and fast returns',
        choices=NOD_MODES,
    )
    command_rate: float = parameter(
        5.0, 'How often the nod command is repeated', unit='Hz', minimum=1.0, maximum=100.0
    )
    scan_timeout: float = parameter(
        2.0,
        'Without a scan for this long the nod command is no longer repeated, so the servo lets go',
        unit='s',
        minimum=0.1,
        maximum=60.0,
    )
    adapt_limits: bool = parameter(
        False,
        'Let the limits of the nod follow the median range ahead, so that a band of heights stays '
        'covered; never beyond pitch_min and pitch_max',
        live=True,
    )
    band_bottom: float = parameter(
        0.1,
        'Lower end of the band of heights, above the floor; what is lower does not count',
        unit='m',
        minimum=-100.0,
        maximum=100.0,
    )
    band_top: float = parameter(
        2.0, 'Upper end of the band of heights', unit='m', minimum=-100.0, maximum=100.0
    )
    sensor_height: float = parameter(
        1.08,
        'Height of the optical centre above the floor at pitch 0',
        unit='m',
        minimum=-100.0,
        maximum=100.0,
    )
    limits_rate: float = parameter(
        1.0, 'Fastest change of an adapted limit', unit='rad/s', minimum=0.01, maximum=100.0
    )
    max_nod_speed: float = parameter(
        6.0,
        'Speed that the servo holds: with adapted limits N_s rises where it would be exceeded',
        unit='rad/s',
        minimum=0.01,
        maximum=100.0,
    )
    max_nod_acceleration: float = parameter(
        150.0,
        'Acceleration that the servo is sure to reach: N_s rises likewise where turning around '
        'would take more than the whole sweep',
        unit='rad/s^2',
        minimum=1.0,
        maximum=10_000.0,
    )
    timing_error: float = parameter(
        0.003,
        "How far off the servo's turns are, as a standard deviation: with adapted limits the N_s "
        'about samples_per_sweep is taken that sees all cells soonest in spite of it',
        unit='s',
        minimum=0.0,
        maximum=0.1,
    )
    object_size: float = parameter(
        0.1,
        'Smallest object to be seen: as wide as it looks are the cells that coverage counts',
        unit='m',
        minimum=0.02,
        maximum=10.0,
    )
    object_distance: float = parameter(
        2.0,
        'Distance up to which the smallest object is to be seen',
        unit='m',
        minimum=0.05,
        maximum=10.0,
    )
    coverage_window: float = parameter(
        10.0,
        'Time over which coverage is told on ~/coverage and in /diagnostics; with 0 none is kept',
        unit='s',
        minimum=0.0,
        maximum=600.0,
    )

    @property
    def task(self) -> Task:
        """The smallest object, at the greatest distance, between the limits, as cells."""
        return Task(
            object_size=self.object_size,
            distance=self.object_distance,
            pitch_min=self.pitch_min,
            pitch_max=self.pitch_max,
            steps_per_revolution=self.steps_per_revolution,
        )

    def check_together(self) -> None:
        """Raise ParameterError for values that do not go with each other."""
        if self.pitch_max - self.pitch_min < LEAST_SPAN:
            limit = f'at least {LEAST_SPAN} rad above pitch_min = {self.pitch_min} rad'
            raise ParameterError('pitch_max', limit, self.pitch_max)
        if self.band_top <= self.band_bottom:
            limit = f'above band_bottom = {self.band_bottom} m'
            raise ParameterError('band_top', limit, self.band_top)
        if self.object_size > 2.0 * self.object_distance:
            limit = f'at most twice object_distance = {self.object_distance} m'
            raise ParameterError('object_size', limit, self.object_size)
        for key in ('laser_xyz', 'laser_rpy'):
            if len(getattr(self, key)) != 3:
                raise ParameterError(key, 'three numbers', getattr(self, key))
        if self.ego_motion != 'off':
            self._check_ego_motion()

    def _check_ego_motion(self) -> None:
        if self.odom_frame in ('', self.frame_id):
            limit = f"a frame other than frame_id = '{self.frame_id}'"
            raise ParameterError('odom_frame', limit, self.odom_frame)
        if self.cloud_mode == 'sweep' and self.without_odometry != 'drop':
            limit = 'drop with clouds per sweep, whose points are in one frame'
            raise ParameterError('without_odometry', limit, self.without_odometry)
