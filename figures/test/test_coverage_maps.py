"""The maps of Fig. 6 against the coverage of each start on its own."""

from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import pytest

from figures.coverage import maps_of, STARTS


@pytest.mark.parametrize('n_s', [1001, 2745, 2746])
def test_a_start_on_the_way_equals_the_pattern_of_its_phase(n_s):
    task = Task(0.3, 2.0, full_circle=True)
    panels = maps_of(task, n_s)
    for start in STARTS[::15]:
        phase = min(int(start) * n_s // 90, n_s - 1) + 0.5
        figures = Coverage(task, Pattern(1024, n_s, phase)).figures()
        assert panels[0, start] == figures.completion_time
        assert panels[1, start] == pytest.approx(figures.revisit_mean, rel=1e-12)
        assert panels[2, start] == pytest.approx(figures.hit_frequency, rel=1e-12)
