"""The bound against nods enumerated."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_planner.coverage.crossings import NEVER
from nodlidar_planner.coverage.lower_bound import lower_bound
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
from planner_enumeration import enumerate_cells, PUBLISHED


@settings(max_examples=200)
@given(
    st.integers(1, 64),
    st.integers(1, 64),
    st.floats(0.1, 2.0),
    st.booleans(),
    st.integers(0, 7),
    st.floats(0.3, 3.0),
)
def test_nothing_completes_before_the_lower_bound(n_l, n_s, cell, circle, quarters, azimuth):
    task = Task(
        2 * math.sin(cell / 2), 1.0, azimuth=azimuth, full_circle=circle, steps_per_revolution=n_l
    )
    pattern = Pattern(n_l, n_s, (quarters % (8 * n_s)) / 4)
    last = enumerate_cells(task, pattern).first.max()
    completion = last * task.beam_period if last != NEVER else math.inf
    assert lower_bound(task, n_s) <= completion + 1e-12


def test_the_lower_bound_is_near_one_row_per_revolution():
    assert 2.9 < lower_bound(PUBLISHED, 4001) < 3.2
    assert lower_bound(PUBLISHED, 1001) < lower_bound(PUBLISHED, 8000)
    assert lower_bound(Task(azimuth=math.pi), 1001) == math.inf
