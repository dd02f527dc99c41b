"""The maps of Fig. 6 against the coverage of each start on its own."""

from math import asin, ceil, pi, tau

from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import pytest

from bench.nod.published_choice import DISTANCES
from figures.coverage import frequencies_of, maps_of, STARTS
from figures.test.enumeration import crossings


@pytest.mark.parametrize('n_s', [1001, 2745, 2746])
def test_a_start_on_the_way_equals_the_pattern_of_its_phase(n_s):
    task = Task(0.3, 2.0, full_circle=True)
    panels = maps_of(task, n_s)
    for start in STARTS[::15]:
        phase = min(int(start) * n_s // 90, n_s - 1) + 0.5
        figures = Coverage(task, Pattern(1024, n_s, phase)).figures()
        assert panels[0, start] == figures.completion_time
        assert panels[1, start] == pytest.approx(figures.revisit_mean, rel=1e-12)


@pytest.mark.parametrize('n_s', [1001, 2745])
def test_the_hit_frequency_of_fewer_cells_is_that_of_their_crossings(n_s):
    """Counted sample by sample, as in test_published_claims."""
    for at, frequency in list(zip(DISTANCES, frequencies_of(n_s), strict=True))[::3]:
        cell = 2.0 * asin(0.05 / at)
        columns, rows = ceil(tau / cell), ceil(pi / 2 / cell)
        crossed = crossings(n_s, columns, rows, cell, pi / 2)
        expected = crossed / (n_s * 0.1 * columns * rows)
        assert frequency == pytest.approx(expected, rel=0.01)  # a sliver joins its neighbour
