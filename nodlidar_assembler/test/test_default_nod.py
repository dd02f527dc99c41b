"""The default nod is the one that plan_scan chooses, and that the servo can follow."""

from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_planner.commands.plan_scan import find
from nodlidar_planner.pattern.nod_speeds import MAX_ACCELERATION, MAX_SPEED, shortest_by_mean_speed
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.plan_scan.options import parse, Request
import pytest


def test_the_default_nod_is_what_plan_scan_chooses_without_options():
    config, (task, request, _) = NodConfig(), parse(['--top', '1'])  # but for how many it lists
    assert task == config.task == Task()
    assert find(task, request).plans[0].samples_per_sweep == config.samples_per_sweep
    assert config.nod_mode == 'coprime'


def test_plan_scan_plans_for_the_servo_of_the_assembler():
    config, request = NodConfig(), Request()
    assert request.error == config.timing_error
    assert request.fastest(Task()) == config.max_nod_speed
    narrow = Task(pitch_min=-0.1, pitch_max=0.1)
    beams = 1.0 / narrow.beam_period
    fewest = config.fewest_samples(0.2, narrow.beam_period)
    assert request.fastest(narrow) == pytest.approx(0.2 / (fewest / beams), rel=2e-3)
    assert Request(objective='hole').error == Request(time_budget=5.0).error == 0.0


def test_a_sweep_takes_the_time_of_its_speed_or_of_its_reversals():
    assert shortest_by_mean_speed(2.0) == 2.0 / MAX_SPEED
    # Half of the way accelerating, half braking: span / 2 = a (t / 2)^2 / 2.
    half = shortest_by_mean_speed(0.1) / 2.0
    assert MAX_ACCELERATION * half**2 / 2.0 == pytest.approx(0.05)
