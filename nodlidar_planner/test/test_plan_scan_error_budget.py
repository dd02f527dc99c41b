"""plan_scan --error-budget: the table, the JSON object and the picture."""

import json
import math

from matplotlib.figure import Figure
from nodlidar_planner.commands.entry_points import plan_scan
import numpy as np
import pytest

# One N_s, so that nothing is chosen: 1.5 rad/s.
NOD = ('--samples-per-sweep', '8378', '--timing-error', '0')
PITCH = ('--encoder-step', '0.004', '--encoder-noise', '0.004')
ONLY_RANGES = (
    *('--range-noise', '0.003', '--range-noise-growth', '0.002', '--range-bias', '0.004'),
    *('--encoder-step', '1e-7', '--encoder-noise', '0', '--encoder-error', '0'),
    *('--backlash', '0', '--deflection', '0', '--joint-rate', '10000', '--mount-angle-error', '0'),
    *('--mount-position-error', '0', '--joint-delay-error', '0', '--scan-delay-error', '0'),
)


def test_the_json_object_has_the_errors_by_source_and_distance(capsys):
    assert plan_scan(['--json', '--error-budget', '--distance', '2.5', *NOD, *ONLY_RANGES]) == 0
    found = json.loads(capsys.readouterr().out)['error_budget']
    assert found['distances'] == [0.5, 1.0, 2.0, 2.5, 3.0, 4.0, 5.0]
    distances = np.array(found['distances'])
    assert found['rms']['range_noise'] == pytest.approx(np.hypot(0.003, 0.002 * distances))
    total = np.hypot(found['rms']['range_noise'], 0.004)
    assert found['rms']['total'] == pytest.approx(total, rel=1e-3)
    assert found['pitch_error'] == pytest.approx(0.0, abs=1e-5)


def test_without_the_option_there_is_none(capsys):
    assert plan_scan(['--json', *NOD]) == 0
    assert json.loads(capsys.readouterr().out)['error_budget'] is None


@pytest.mark.parametrize(
    ('options', 'backlash'),
    [
        ([], 0.004),
        (['--servo', 'STS3215'], 0.0152),
        (['--servo', 'STS3215', '--backlash', '0.002'], 0.002),
    ],
)
def test_encoder_and_backlash_are_those_of_the_servo(capsys, options, backlash):
    assert plan_scan(['--json', '--error-budget', *NOD, '--deflection', '0', *options]) == 0
    errors = json.loads(capsys.readouterr().out)['error_budget']
    others = errors['rms']['backlash'][-1] / (backlash / 2.0)
    assert others == pytest.approx(5.0 * math.sqrt(0.4), rel=0.05)  # from the axis, RMS


def test_the_table_has_a_row_per_source_in_millimetres(capsys):
    assert plan_scan(['--error-budget', *NOD, *PITCH]) == 0
    table = capsys.readouterr().out.partition('RMS error of a point')[2]
    rows = {line[:18].strip(): line[18:].split() for line in table.splitlines()[1:]}
    assert rows['range noise'] == ['6.3', '7.2', '10.0', '13.4', '17.1', '20.9']
    assert {'pitch estimate', 'backlash', 'encoder error', 'mount', 'total'} < set(rows)
    # Noise of a step: neighbours err independently, by 4/3 steps squared of 13/12.
    error = 0.004 * math.sqrt(2.0 / 3.0 * 13.0 / 12.0)
    assert f'pitch estimated to {error * 1e3:.1f}' in table


def test_the_picture_shows_every_source_over_the_distance(tmp_path, monkeypatch):
    drawn = []
    save = Figure.savefig
    monkeypatch.setattr(
        Figure, 'savefig', lambda self, *a, **k: (drawn.append(self), save(self, *a, **k))
    )
    assert plan_scan(['--error-budget', *NOD, '--plot', str(tmp_path / 'errors.png')]) == 0
    assert (tmp_path / 'errors.png').stat().st_size > 10_000
    lines = {line.get_label(): line for line in drawn[0].axes[0].get_lines()}
    assert 'odometry' not in lines  # the robot stands
    x, y = lines['range noise'].get_data()
    assert y == pytest.approx(np.hypot(6.0, 4.0 * np.array(x)))
    assert np.all(np.diff(lines['total'].get_ydata()) > 0.0)


def test_reversals_that_take_longer_than_a_sweep_are_refused(capsys):
    assert plan_scan(['--error-budget', *NOD, '--reversal-acceleration', '2']) != 0
    assert "'--reversal-acceleration' must be at least" in capsys.readouterr().err
