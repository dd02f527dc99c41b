"""The command plan_scan: what it prints, against enumeration; its errors and its pictures."""

from contextlib import redirect_stderr, redirect_stdout
from dataclasses import fields, replace
import io
import json
import math
import re

from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure
from nodlidar_common import command_line
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_planner.choice.objective import Objective
from nodlidar_planner.choice.plan import evaluate
from nodlidar_planner.choice.timing_error import UnderError
from nodlidar_planner.commands import plan_scan as module
from nodlidar_planner.commands.entry_points import plan_scan
from nodlidar_planner.holes.hole import Hole
from nodlidar_planner.pattern.nod_speeds import MAX_SPEEDS
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import AZIMUTH_OF_STEP_0, Task
from nodlidar_planner.plan_scan import progress
from nodlidar_planner.plan_scan.options import objective_of, parse, Request
from nodlidar_planner.plan_scan.pictures import (
    Candidates,
    draw_completion,
    draw_pattern,
    outline_hole,
)
from nodlidar_planner.plan_scan.words import notes
from nodlidar_sim.world.nod_motion import triangle_motion
import numpy as np
from planner_enumeration import cells_of_samples, enumerate_cells, widest_by_corners
import pytest

QUARTER = math.pi / 4
# What model.md's table is about: 10 cm at 2 m, all around, a right angle of pitch.
FULL_SIZE = ['--full-circle', f'--pitch-min={-QUARTER}', f'--pitch-max={QUARTER}']
# A lidar and a band that are enumerated in no time: N_s 41 .. 60.
SMALL = [
    *('--object', '0.45', '--steps-per-revolution', '64', '--full-circle'),
    *('--speed-min', '13.1', '--speed-max', '19.1'),
]
PERFECT = ('--timing-error', '0')
SMALL_TASK = Task(object_size=0.45, steps_per_revolution=64, full_circle=True)
SMALL_BAND = [n for n in range(42, 60) if n % 2]


@pytest.fixture
def run(capsys):
    """Return what runs the command: its status, stdout and stderr."""

    def run(*options):
        return plan_scan(options), *capsys.readouterr()

    return run


@pytest.fixture
def plan_of(run):
    """Return what runs the command with --json and gives its object."""

    def plan_of(*options):
        status, out, _ = run('--json', *options)
        assert status == 0
        return json.loads(out, parse_constant=pytest.fail)

    return plan_of


def test_the_json_object_has_every_key_with_its_type(plan_of):
    plan = plan_of(*SMALL, *PERFECT)
    whole = {'samples_per_sweep', 'cells', 'distinct_directions', 'columns', 'rows'}
    real = {'speed', 'sweep_duration', 'completion_time', 'revisit_max', 'revisit_mean'}
    real |= {'hit_frequency', 'lower_bound', 'never_hit_share', 'hole', 'phase', 'start_pitch'}
    real |= {'hole_after', 'cell'}
    assert {key for key, value in plan.items() if type(value) is int} == whole
    assert {key for key, value in plan.items() if type(value) is float} == real
    assert plan['under_error'] is None
    assert plan['nominal'] is None
    assert isinstance(plan['notes'], list)
    assert 'alternatives' not in plan


@pytest.mark.parametrize(
    ('servo', 'slowest'),  # a sweep of 1.2272 rad takes up to 8000 / 10240 s
    [('XL430-W250', 1.5708), ('XL330-M288', 1.5708), ('XL330-M077', MAX_SPEEDS['XL330-M077'] / 2)],
)
def test_the_nod_is_one_that_the_servo_can_do(plan_of, servo, slowest):
    plan = plan_of('--servo', servo, *PERFECT)
    assert slowest - 1e-3 <= plan['speed'] <= MAX_SPEEDS[servo]


def test_the_figures_of_the_model_come_out(plan_of):
    start = ['--start-pitch', str(-QUARTER), '--samples-per-sweep', '2745']
    plan = plan_of(*FULL_SIZE, *start)
    assert plan['completion_time'] == pytest.approx(13.13, abs=0.005)
    assert plan['samples_per_sweep'] == 2745
    assert plan['phase'] == 0.0
    assert plan['cells'] == 4032
    assert plan['sweep_duration'] == pytest.approx(2745 / 10240)
    assert plan['speed'] == pytest.approx(math.pi / 2 * 10240 / 2745)
    assert plan['distinct_directions'] == (1024 * 2745 + 1024) / 2
    assert 0.0 < plan['lower_bound'] < plan['completion_time']


@pytest.mark.parametrize('samples_per_sweep', [41, 48, 64])
def test_all_figures_are_those_of_enumeration(plan_of, samples_per_sweep):
    plan = plan_of(*SMALL, '--samples-per-sweep', str(samples_per_sweep))
    pattern = Pattern(64, samples_per_sweep, 0.5)
    found = enumerate_cells(SMALL_TASK, pattern)
    never = float(np.mean(found.crossings == 0))
    expected = {
        'completion_time': found.first.max() / 640 if never == 0 else None,
        'revisit_max': found.longest_gap.max() / 640 if never == 0 else None,
        'revisit_mean': found.longest_gap.mean() / 640 if never == 0 else None,
        'hit_frequency': found.crossings.mean() / (pattern.period / 640),
        'never_hit_share': never,
    }
    assert {key: plan[key] for key in expected} == pytest.approx(expected)


def test_the_choice_is_the_soonest_of_the_band(plan_of):
    completion = {
        n_s: enumerate_cells(SMALL_TASK, Pattern(64, n_s, 0.5)).first.max() / 640
        for n_s in SMALL_BAND
    }
    plan = plan_of(*SMALL, *PERFECT, '--top', '4')
    times = [each['completion_time'] for each in [plan, *plan['alternatives']]]
    assert times == pytest.approx(sorted(completion.values())[:4])
    assert completion[plan['samples_per_sweep']] == pytest.approx(times[0])
    assert plan['lower_bound'] <= times[0]


def test_a_start_pitch_is_where_the_nod_is_at_step_0(plan_of):
    plan = plan_of(*SMALL, '--samples-per-sweep', '50', '--start-pitch', '0.3')
    assert plan['start_pitch'] == pytest.approx(0.3)
    assert plan['phase'] == pytest.approx((0.3 + 0.6136) / 1.2272 * 50)


@pytest.mark.parametrize('quarters', range(1, 200, 29))
def test_a_start_at_a_whole_part_of_a_sample_has_the_directions_of_that_phase(plan_of, quarters):
    start = -0.6136 + 1.2272 / 50 * quarters / 4
    plan = plan_of(*SMALL, '--samples-per-sweep', '50', '--start-pitch', repr(start))
    assert plan['phase'] == quarters / 4
    assert plan['distinct_directions'] == Pattern(64, 50, quarters / 4).distinct_directions


def test_another_objective_chooses_otherwise(plan_of):
    by_completion, by_revisit = (
        plan_of(*SMALL, *PERFECT, '--objective', o) for o in ('completion', 'revisit')
    )
    longest = {
        n_s: enumerate_cells(SMALL_TASK, Pattern(64, n_s, 0.5)).longest_gap.max() / 640
        for n_s in SMALL_BAND
    }
    assert by_revisit['revisit_max'] == pytest.approx(min(longest.values()))
    assert by_revisit['completion_time'] >= by_completion['completion_time']


def test_the_table_has_the_plan_and_its_alternatives(run, plan_of):
    best = plan_of(*SMALL)
    status, out, err = run(*SMALL, '--top', '3')
    assert (status, err) == (0, '')
    cells = [re.split(' {2,}', line.strip()) for line in out.splitlines()]
    rows = {name: value for name, value, *_ in filter(lambda row: len(row) == 2, cells)}
    assert rows['samples per sweep (N_s)'].startswith(str(best['samples_per_sweep']))
    assert f'{best["completion_time"]:.4g} s' in rows['every cell hit once after']
    assert f'{best["lower_bound"]:.4g} s' in rows['lower bound, allowed speeds']
    assert 'The best 3' in out
    assert max(map(len, out.splitlines())) <= 100


def brute_holes(time):
    """Return the largest hole of each nod of the small band after a time."""
    samples = math.ceil(time * 640 * (1.0 - 1e-12))
    return [widest_by_corners(SMALL_TASK, Pattern(64, n, 0.5), samples) for n in SMALL_BAND]


def test_a_time_budget_gives_the_nod_with_the_smallest_hole(plan_of):
    plan = plan_of(*SMALL, '--time-budget', '0.8')
    assert plan['hole'] == pytest.approx(min(brute_holes(0.8)))
    assert plan['hole_after'] <= 0.8
    assert plan['hole'] == pytest.approx(min(brute_holes(plan['hole_after'])))
    assert plan['hole'] < min(brute_holes(plan['hole_after'] - 1 / 640)) - 1e-9
    own = {key: plan[key] for key in ('samples_per_sweep', 'hole')}
    assert own | {'time': plan['hole_after']} in plan['front']


def test_a_hole_gives_the_nod_that_is_there_soonest(plan_of):
    plan = plan_of(*SMALL, '--max-hole', '15')
    assert plan['hole'] <= math.radians(15.0)
    assert plan['hole'] == pytest.approx(min(brute_holes(plan['hole_after'])))
    assert math.radians(15.0) < min(brute_holes(plan['hole_after'] - 1 / 640))
    alone = plan_of(*SMALL, '--max-hole', '15', '--samples-per-sweep', '43')
    assert alone['samples_per_sweep'] == 43
    assert alone['hole_after'] >= plan['hole_after']


def test_the_front_is_as_small_as_any_hole_and_smaller_the_later(plan_of):
    front = plan_of(*SMALL, '--time-budget', '0.8')['front']
    assert len(front) > 2
    assert [each['hole'] for each in front] == sorted((e['hole'] for e in front), reverse=True)
    for each in front:
        assert each['hole'] == pytest.approx(min(brute_holes(each['time'])))


def test_under_a_timing_error_the_front_is_of_medians(run, plan_of):
    error = ['--timing-error', '0.003', '--speed-min', '17']  # three nods
    plan = plan_of(*SMALL, '--time-budget', '0.8', *error)
    [corner] = [each for each in plan['front'] if each['time'] == plan['hole_after']]
    assert corner['samples_per_sweep'] == plan['samples_per_sweep']
    hole = plan['hole_under_error']
    assert hole['error'] == plan['under_error']['error'] == 0.003
    # Other runs than those that it was chosen by.
    assert corner['hole'] * 0.8 < hole['median'] <= hole['p90'] < corner['hole'] * 2.0
    assert plan['hole'] == pytest.approx(
        widest_by_corners(
            SMALL_TASK,
            Pattern(64, plan['samples_per_sweep'], 0.5),
            round(plan['hole_after'] * 640),
        )
    )
    _, out, _ = run(*SMALL, '--time-budget', '0.8', *error)
    assert 'under 3 ms of timing error, medians' in out
    assert f'({math.degrees(hole["p90"]):.2f}°) (90 %)' in out


def test_time_and_hole_go_together_or_the_nearest_that_do_are_named(run, plan_of):
    corner = plan_of(*SMALL, '--max-hole', '15')
    later = str(corner['hole_after'] + 0.01)
    assert plan_of(*SMALL, '--max-hole', '15', '--time-budget', later) == corner
    smallest = plan_of(*SMALL, '--time-budget', '0.5')
    status, out, err = run(*SMALL, '--max-hole', '15', '--time-budget', '0.5')
    assert (status, out, err.count('\n')) == (2, '', 1)
    assert f'(N_s = {smallest["samples_per_sweep"]})' in err
    assert f's (N_s = {corner["samples_per_sweep"]})' in err
    hole, time = re.findall(r'at least ([\d.]+)(?:° after 0.5 s| s)', err)
    assert float(hole) == pytest.approx(math.degrees(smallest['hole']), rel=1e-3)
    assert float(time) == pytest.approx(corner['hole_after'], rel=1e-3)
    # What is named is allowed.
    assert plan_of(*SMALL, '--max-hole', hole, '--time-budget', '0.5') == smallest
    assert plan_of(*SMALL, '--max-hole', '15', '--time-budget', time) == corner


def test_the_front_is_a_table_and_a_picture(run, plan_of, tmp_path):
    plan = plan_of(*SMALL, '--time-budget', '0.8')
    picture = tmp_path / 'front.png'
    status, out, err = run(*SMALL, '--time-budget', '0.8', '--plot', str(picture))
    assert (status, err) == (0, '')
    assert picture.stat().st_size > 10_000
    rows = [line.split() for line in out[out.index('smallest hole') :].splitlines()]
    shown = [row for row in rows if row and row[0].isdigit()]
    assert [int(row[0]) for row in shown] == [each['samples_per_sweep'] for each in plan['front']]
    [chosen] = [row for row in shown if row[-1] == 'chosen']
    assert int(chosen[0]) == plan['samples_per_sweep']
    assert float(chosen[4]) == pytest.approx(math.degrees(plan['hole']), rel=1e-3)


def test_a_timing_error_is_planned_for_and_compared(run, plan_of):
    robust = plan_of(*SMALL, '--timing-error', '0.002', '--top', '2')
    perfect = plan_of(*SMALL, *PERFECT)
    assert robust['nominal']['samples_per_sweep'] == perfect['samples_per_sweep']
    for plan in (robust, robust['nominal'], *robust['alternatives']):
        under = plan['under_error']
        assert under['error'] == 0.002
        assert 0.0 < under['median'] <= under['p90']
    assert robust['completion_time'] >= robust['nominal']['completion_time']
    _, out, _ = run(*SMALL, '--timing-error', '0.002')
    assert 'under 2 ms of timing error' in out
    assert f'{robust["under_error"]["p90"]:.4g} s (90 %)' in out
    assert 'nominal best' in out


@pytest.mark.parametrize('error', ['0.05', '0.3', '1'])
def test_a_timing_error_that_upsets_whole_sweeps_has_a_plan_too(plan_of, recwarn, error):
    plan = plan_of(*SMALL, '--timing-error', error)
    assert 0.0 < plan['under_error']['median'] <= plan['under_error']['p90']
    assert 0.0 < plan['hole_under_error']['median'] <= plan['hole_under_error']['p90']
    assert len(recwarn) == 0


@pytest.mark.parametrize(
    ('options', 'said'),
    [
        (['--object', '0'], ["'--object'", '1e-06', 'is 0.0']),
        (['--object', 'nan'], ["'--object'", 'finite', 'nan']),
        (['--object', 'big'], ['--object', 'a number', "'big'"]),
        (['--object', '5'], ["'--object'", 'twice the distance', '5.0']),
        (['--pitch-min', '0.5', '--pitch-max', '0.5'], ["'--pitch-max'", 'above', '0.5']),
        (['--steps-per-revolution', '0'], ["'--steps-per-revolution'", '1', 'is 0']),
        (['--speed-min', '5', '--speed-max', '4'], ["'--speed-max'", '5.0', 'is 4.0']),
        (['--speed-max', '1e-5'], ["'--speed-max'", 'N_s = 7999', 'speed_min', '1e-05']),
        (['--speed-min', '20'], ["'--speed-min'", 'at most 6 rad/s', 'servo', 'is 20.0']),
        (['--azimuth', '3.14', '--speed-min', '5'], ["'--azimuth'", 'has a beam']),
        (['--objective', 'hole', '--timing-error', '0.001'], ["'--timing-error'", 'is 0.001']),
        (['--start-pitch', '1'], ["'--start-pitch'", '0.6136', 'is 1.0']),
        (['--objective', 'speed'], ["'--objective'", 'completion', "'speed'"]),
        (['--objective', 'hole=1,hole=2'], ["'--objective'", 'once', "'hole=1,hole=2'"]),
        (['--objective', 'hole=-1'], ["'--objective'", 'below 0', "'hole=-1'"]),
        (['--timing-error', '-1e3'], ['--timing-error']),
        (['--timing-error', '2'], ["'--timing-error'", '1.0', 'is 2.0']),
        (['--samples-per-sweep', '0'], ["'--samples-per-sweep'", '1', 'is 0']),
        (['--samples-per-sweep', '1.5'], ['--samples-per-sweep', 'whole', "'1.5'"]),
        (['--samples-per-sweep', '10000000'], ["'--samples-per-sweep'", '1000000', '10000000']),
        (['--top', '0'], ["'--top'", '1', 'is 0']),
        (['--time-budget', '0'], ["'--time-budget'", '600', 'is 0.0']),
        (['--time-budget', '1e-3'], ["'--time-budget'", 'so long', 'is 0.001']),
        (['--max-hole', '0.3'], ["'--max-hole'", 'at least 0.3516°', 'is 0.3']),
        (['--max-hole', '75'], ["'--max-hole'", 'below 70.31°', 'is 75.0']),
        (['--max-hole', '2', '--objective', 'revisit'], ["'--objective'", 'left out']),
        (['--time-budget', '2', '--top', '3'], ["'--top'", 'left out', 'is 3']),
        (['--plot', 'plan.gif'], ["'--plot'", '.png', "'plan.gif'"]),
        (['--plot', 'no/such/plan.png'], ["'--plot'", 'folder', "'no/such/plan.png'"]),
        (['--full-circle', '--azimuth', '0.5'], ['--azimuth', 'left out', '0.5']),
        (['--sped-max', '4'], ['--sped-max']),
        (['--obj', '4'], ['--obj']),
    ],
)
def test_an_error_is_a_line_that_names_the_limit(run, options, said):
    status, out, err = run(*options)
    assert (status, out) == (2, '')
    assert err.startswith('plan_scan: error: ')
    assert err.count('\n') == 1
    assert [part for part in said if part not in err] == []


def test_a_picture_that_cannot_be_written_is_an_error(run, tmp_path):
    (tmp_path / 'plan.png').mkdir()
    status, _, err = run(*SMALL, '--plot', str(tmp_path / 'plan.png'))
    assert (status, err.count('\n')) == (2, 1)
    assert '--plot' in err


def test_an_interruption_is_a_line(run, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(module, 'plans', interrupted)
    assert run(*SMALL) == (130, '', 'plan_scan: interrupted\n')


@pytest.mark.parametrize(
    ('text', 'objective'),
    [
        ('completion', Objective(1.0, 0.0, 0.0)),
        ('revisit', Objective(0.0, 1.0, 0.0)),
        ('hole, hole_after=8', Objective(0.0, 0.0, 1.0, 8.0)),
        ('completion=1,revisit=0.5,hole=10', Objective(1.0, 0.5, 10.0)),
    ],
)
def test_objectives(text, objective):
    assert objective_of(text) == objective


@pytest.mark.parametrize(
    'text', ['', 'hole=', 'hole=x', 'hole=inf', 'revisit=0', 'a=1', 'hole_after=3']
)
def test_what_is_no_objective(text):
    with pytest.raises(ParameterError, match='objective'):
        objective_of(text)


@pytest.mark.parametrize(
    ('options', 'speeds'),
    [
        ('--samples-per-sweep 1', (3.1, 3.2)),
        ('--samples-per-sweep 4000', (3.1, 3.2)),
        ('--samples-per-sweep 30001 --timing-error 0.003', (3.1, 3.11)),
        ('--samples-per-sweep 3001 --object 3', (3.1, 3.2)),
        ('--samples-per-sweep 3001 --object 0.005 --azimuth 0.3', (3.1, 3.11)),
        ('--samples-per-sweep 2001 --azimuth 3.14159', (3.1, 3.2)),
        ('--samples-per-sweep 2001 --start-pitch 0.6136', (3.1, 3.2)),
        ('--samples-per-sweep 3001 --pitch-max=-0.6135', (3e-4, 3.1e-4)),
        ('--samples-per-sweep 1001 --steps-per-revolution 1', (0.1, 0.2)),
        ('--samples-per-sweep 1001 --steps-per-revolution 1 --full-circle', (0.1, 0.2)),
        ('--samples-per-sweep 1001 --steps-per-revolution 1440', (3.1, 3.2)),
        ('--samples-per-sweep 9001 --steps-per-revolution 16384', (22.0, 22.1)),
        ('--objective hole', (3.14, 3.15)),
    ],
)
def test_extremes_have_a_plan_and_a_picture(run, plan_of, tmp_path, options, speeds):
    band = [f'--speed-min={speeds[0]}', f'--speed-max={speeds[1]}']
    plot = ['--plot', str(tmp_path / 'plan.png')]
    options = ['--timing-error=0', *options.split(), *band, *plot]
    plan = plan_of(*options[:-2])
    assert (plan['completion_time'] is None) == (plan['never_hit_share'] > 0.0)
    assert bool(plan['notes']) or plan['never_hit_share'] == 0.0
    status, out, _ = run(*options)
    assert status == 0
    assert (tmp_path / 'plan.png').stat().st_size > 5_000
    assert 'nan' not in out
    assert ('never hit' in out) == (plan['never_hit_share'] > 0.0)


def test_notes_on_plans():
    def said(n_s, start_pitch=None, error=0.0, servo='RX-24F', **task):
        task = Task(**task)
        return '\n'.join(notes(task, evaluate(task, n_s, start_pitch, error), servo))

    assert said(4001) == ''
    assert 'divisor 32' in said(4000)
    assert 'divisor' not in said(2002, steps_per_revolution=450)  # all directions are distinct
    assert 'divisor 150: the pattern repeats 75' in said(1500, steps_per_revolution=450)
    # 12.6 rad/s, and 3.1 rad/s for the others.
    assert 'the servo RX-24F nods at 6 rad/s at most' in said(1001)
    assert 'every servo, takes 0.1255 s: more than a sweep' in said(1001)
    assert 'XL330-M077 nods at 2 rad/s at most' in said(4001, servo='XL330-M077')
    assert 'of the 126 columns' in said(4001, azimuth=math.pi)
    assert 'hits is random' in said(1001, error=0.008)
    assert f'{1024 * 4001} are distinct' in said(4001, start_pitch=-0.6136)
    assert 'cannot hit 25 rows' in said(11)
    assert 'never completes\n' in said(11)
    late = replace(evaluate(Task(), 64), under_error=UnderError(0.003, 60.0, 60.0, 60.0))
    assert 'never completes without timing error' in '\n'.join(notes(Task(), late, 'RX-24F'))


def test_a_distance_beyond_the_range_of_the_lidar_is_noted():
    for distance, range_max, noted in ((5.6, 5.6, False), (6.0, 5.6, True), (6.0, 10.0, False)):
        task = Task(0.5, distance, range_max=range_max)
        said = '\n'.join(notes(task, evaluate(task, 4001), 'RX-24F'))
        assert ('the lidar sees 5.6 m far, not 6 m' in said) is noted


def test_a_low_last_row_is_noted_with_limits_that_mend_it():
    task = Task(0.1, 4.0)
    said = '\n'.join(notes(task, evaluate(task, 4001), 'RX-24F'))
    pitch_max = float(re.search(r'0.087 of a cell high.*--pitch-max (\S+) it is whole', said)[1])
    whole = replace(task, pitch_max=pitch_max)
    assert whole.rows == task.rows
    assert 'of a cell high' not in '\n'.join(notes(whole, evaluate(whole, 4001), 'RX-24F'))
    times = [evaluate(each, 4001).figures.completion_time for each in (whole, task)]
    assert times[0] < 0.5 * times[1]


def test_a_low_last_row_at_the_steepest_pitch_is_noted_with_limits_that_leave_it_out():
    task = Task(0.1, 1.0, 1.6 - 4.2 * 2.0 * math.asin(0.05), 1.6)
    said = '\n'.join(notes(task, evaluate(task, 4001), 'RX-24F'))
    pitch_max = float(re.search(r'0.2 of a cell high.*--pitch-max (\S+) it is left out', said)[1])
    without = replace(task, pitch_max=pitch_max)
    assert without.rows == task.rows - 1 == 4
    assert without.last_row == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize('samples_per_sweep', [6273, 7271, 7547, 8311])
def test_it_is_noted_if_an_object_may_lie_between_cells_that_are_all_hit(samples_per_sweep):
    """By the empty squares of a fine raster of the samples until completion."""
    task = Task()
    plan = evaluate(task, samples_per_sweep)
    n = np.arange(round(plan.figures.completion_time / task.beam_period) + 1)
    step = n % task.steps_per_revolution
    fine = 20  # pixels of a cell
    measured = task.column_of_step()[step] >= 0
    place = (n + plan.phase) % (2 * samples_per_sweep)
    height = np.minimum(place, 2 * samples_per_sweep - place) / samples_per_sweep * task.span
    azimuth = (step - step[measured].min()) * math.tau / task.steps_per_revolution
    pixel = np.floor(np.stack([azimuth, height])[:, measured] / task.cell * fine).astype(int)
    hit = np.zeros(pixel.max(axis=1) + 1, dtype=np.int64)
    hit[tuple(pixel)] = 1
    total = np.pad(hit.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))

    def empty(side):
        sums = total[side:, side:] - total[:-side, side:] - total[side:, :-side]
        return ((sums + total[:-side, :-side]) == 0).any()

    said = '\n'.join(notes(task, plan, 'RX-24F'))
    found = re.search(r'an empty square of (\S+) cells', said)
    if found:
        assert empty(round((float(found[1]) - 0.1) * fine))
    else:
        assert not empty(fine + 1)


def test_a_single_row_is_not_noted_as_low():
    task = Task(pitch_max=-0.6)
    assert task.rows == 1
    assert 'row' not in '\n'.join(notes(task, evaluate(task, 4001), 'RX-24F'))


@pytest.mark.parametrize('samples_per_sweep', [1001, 1401, 2757, 3801, 3901, 4001, 7999])
def test_it_is_noted_if_the_simulated_servo_misses_the_outermost_row(samples_per_sweep):
    task, sweep = Task(), samples_per_sweep / 10240
    said = '\n'.join(notes(task, evaluate(task, samples_per_sweep), 'RX-24F'))
    nod = Nod(task.pitch_min, task.pitch_max, sweep, samples_per_sweep, 0)
    end_ns = round(3e9 * sweep)
    try:
        motion = triangle_motion(nod, 0, end_ns)
    except ParameterError:
        assert 'more than a sweep' in said
        return
    pitch = motion.position(np.linspace(0, end_ns, 100_000).astype(np.int64))
    height = (pitch - task.pitch_min) / task.span * samples_per_sweep
    rows = np.unique(task.row_of_height(height, samples_per_sweep))
    assert ('misses the outermost row' in said) == (len(rows) < task.rows)


@pytest.mark.parametrize(
    ('name', 'begin', 'error'),
    [('a.png', b'\x89PNG', '0.002'), ('a.pdf', b'%PDF', '0'), ('a.SVG', b'<?xml', '0')],
)
def test_the_format_of_a_picture_is_that_of_its_suffix(run, tmp_path, name, begin, error):
    status, _, _ = run(*SMALL, '--timing-error', error, '--plot', str(tmp_path / name))
    assert status == 0
    content = (tmp_path / name).read_bytes()
    assert content.startswith(begin)
    assert len(content) > 10_000


def test_the_pattern_fills_the_cells_that_no_sample_hit():
    axes = Figure().subplots()
    pattern = Pattern(64, 41, 0.5)
    draw_pattern(axes, SMALL_TASK, pattern, 200 / 640)
    drawn = np.ma.filled(axes.images[0].get_array(), np.nan)
    hit = np.zeros(SMALL_TASK.cells, dtype=bool)
    hit[cells_of_samples(SMALL_TASK, pattern, np.arange(200))] = True
    np.testing.assert_array_equal(np.isnan(drawn).T.ravel(), hit)
    assert 0 < hit.sum() < SMALL_TASK.cells
    assert f'{np.sum(~hit)} of {SMALL_TASK.cells} cells' in axes.get_title()
    assert len(axes.collections[0].get_offsets()) == 200


def test_a_hole_across_the_seam_is_outlined_at_both_ends():
    axes = Figure().subplots()
    outline_hole(axes, SMALL_TASK, Hole(side=0.4, azimuth=AZIMUTH_OF_STEP_0 + 0.1, pitch=0.2))
    outline_hole(axes, Task(), Hole(side=0.4, azimuth=-1.0, pitch=0.2))
    seam = AZIMUTH_OF_STEP_0 - 0.1
    corners = [(patch.get_x(), patch.get_y()) for patch in axes.patches]
    np.testing.assert_allclose(
        corners, [(seam + math.tau, 0.0), (seam, 0.0), (-1.2, 0.0)], atol=1e-12
    )
    assert {patch.get_width() for patch in axes.patches} == {0.4}


def test_candidates_that_never_complete_are_marked():
    axes = Figure().subplots()
    completion = np.array([3.0, math.inf, 5.0, math.inf])
    draw_completion(axes, Candidates(np.array([41, 42, 43, 44]), completion), 2.0)
    finite, never, bound = axes.lines
    np.testing.assert_array_equal(finite.get_xydata(), [[41, 3.0], [43, 5.0]])
    np.testing.assert_array_equal(never.get_xdata(), [42, 44])
    assert set(bound.get_ydata()) == {2.0}
    assert axes.get_yscale() == 'log'


def test_a_progress_bar_appears_on_stderr_when_it_takes_long(capsys, monkeypatch):
    monkeypatch.setenv('TERM', 'xterm')
    monkeypatch.setenv('FORCE_COLOR', '1')  # as on a terminal
    assert list(progress.progress(range(5))) == [0, 1, 2, 3, 4]
    assert capsys.readouterr() == ('', '')
    monkeypatch.setattr(progress, 'BAR_AFTER', -1.0)
    monkeypatch.setenv('FORCE_COLOR', '')
    assert list(progress.progress(range(5))) == [0, 1, 2, 3, 4]
    assert capsys.readouterr() == ('', '')
    monkeypatch.setenv('FORCE_COLOR', '1')
    monkeypatch.setenv('TERM', 'dumb')
    assert list(progress.progress(range(5))) == [0, 1, 2, 3, 4]
    assert capsys.readouterr() == ('', '')
    monkeypatch.setenv('TERM', 'xterm')
    assert list(progress.progress(range(5))) == [0, 1, 2, 3, 4]
    out, err = capsys.readouterr()
    assert out == ''
    assert 'evaluating nods' in err


OPTION = st.tuples(
    st.sampled_from(
        [f.name.replace('_', '-') for of in (Task, Request) for f in fields(of)] + ['object', 'x']
    ),
    st.one_of(
        st.floats().map(repr),
        st.integers(-(10**30), 10**30).map(str),
        st.sampled_from(['', 'x', 'hole=1,hole_after=1e-9', 'a.png', '/proc/a.png', '\n', '٣']),
        st.none(),
    ),
)


@settings(max_examples=100)
@given(st.lists(OPTION, max_size=4))
def test_any_command_line_is_a_request_or_a_line_with_status_2(options):
    argv = [f'--{name}' if value is None else f'--{name}={value}' for name, value in options]
    err = io.StringIO()
    with redirect_stderr(err), redirect_stdout(io.StringIO()):
        status = command_line.run('plan_scan', lambda: parse(argv) and None)
    assert (status, err.getvalue().count('\n')) in [(0, 0), (2, 1)]
