"""Figures that pages quote outside of tables are those that are recorded."""

from pathlib import Path
import re

import pytest

from bench.shared.report import recorded

WORKSPACE = Path(__file__).parents[2]
ROUNDED = 0.02  # share by which a quoted figure may be off, beside the rounding of its last digit
README, BUDGET, PHYSICS = 'README.md', 'docs/error_budget.md', 'docs/physics.md'
SERVO = 'nodlidar_servo/README.md'
# Parts of rows, by which they are found, and columns.
FAST, BALANCED, LIVE = {'profile': 'fast'}, {'profile': 'balanced'}, {'set-up': 'profile balanced'}
ERRORS, AT_PI = 'RMS distance, devices with errors [mm]', 'the same at pi rad/s [mm]'
SLERP, TRAJECTORY = {'estimator': 'slerp'}, {'estimator': 'trajectory'}
OFF, PER_BEAM, TIME = {'ego-motion': 'off'}, {'ego-motion': 'per beam'}, 'time per scan [us]'
MOVING = {'robot': 'drives', 'poses': 'one per beam'}
ONE_POSE = {'robot': 'drives', 'poses': 'one per scan, at its middle'}
FILTERED = 'the same, filtered [mm]'
URG, AT_20_HZ = {'lidar': 'URG-04LX-UG01'}, {'joint states [Hz]': 20.0, 'encoder [bits]': 10}
PLANNED = {'servo': 'rx24f', 'nod': 'as planned'}
PLANNED_AT_62_HZ = {'servo': 'rx24f', 'nod': 'as planned, 62 Hz'}
SCATTER = 'scatter of the reversals [ms]'

# Of each measurement: the page, its words around the figure, the row and the column.
QUOTED = {
    'profiles': [
        (README, '`fast` has {} mm in place', FAST, ERRORS),
        (README, 'in place of {} mm, at', BALANCED, ERRORS),
        (README, 'at {} of the computation', FAST, 'computation to balanced'),
        (README, 'At π rad/s it has {} mm', FAST, AT_PI),
        (README, 'in place of {} mm ([profiles]', BALANCED, AT_PI),
    ],
    'estimators': [
        (README, 'become points in about {} µs', SLERP | OFF, TIME),
        (README, '({} µs with per-beam odometry', SLERP | PER_BEAM, TIME),
        (README, '{} µs with `trajectory`', TRAJECTORY | OFF, TIME),
    ],
    'live': [
        (README, 'a cloud is published {} ms after', LIVE, 'latency p50 [ms]'),
        (README, '99th percentile: {} ms', LIVE, 'latency p99 [ms]'),
        (README, 'All nodes together use {} %', LIVE, 'CPU of all nodes [%]'),
    ],
    'ego_motion': [
        (README, 'has [{} mm](docs/moving_robot.md', MOVING, FILTERED),
        (README, 'and {} mm with a single pose', ONE_POSE, FILTERED),
    ],
    'error_budget': [
        (BUDGET, '*calibrated*: {} mm', URG | {'choice': '`balanced`'}, 'at 2 m [mm]'),
    ],
    'sensing': [(BUDGET, '[{} measured]', AT_20_HZ, 'trajectory, RX-24F [mrad]')],
    'servos': [
        (PHYSICS, 'those of the RX-24F by {} ms', PLANNED, SCATTER),
        (PHYSICS, 'at its 6 rad/s by {} ms', PLANNED_AT_62_HZ, SCATTER),
    ],
    'limit_changes': [
        (SERVO, 'and within {} s;', {'change': 'another speed'}, 'longest [s]'),
        (SERVO, '{} s if a change comes', {'change': 'one after the other'}, 'longest [s]'),
        (SERVO, 'no more than {} s, if', {'change': 'far away'}, 'longest [s]'),
    ],
}


@pytest.mark.parametrize(
    ('name', 'page', 'words', 'row', 'column'),
    [(name, *quoted) for name, group in QUOTED.items() for quoted in group],
)
def test_a_quoted_figure_is_the_recorded_one(name, page, words, row, column):
    text = ' '.join((WORKSPACE / page).read_text().split())
    [figure] = re.findall(re.escape(words).replace(r'\{\}', r'([\d.]*\d)'), text)
    [value] = [each[column] for each in recorded(name)['rows'] if row.items() <= each.items()]
    half_a_digit = 0.5 * 10.0 ** -len(figure.partition('.')[2])
    assert float(figure) == pytest.approx(value, rel=ROUNDED, abs=half_a_digit)
