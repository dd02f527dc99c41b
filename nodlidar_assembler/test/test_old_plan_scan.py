import sys

from nodlidar_assembler import plan_scan


def test_the_old_name_of_plan_scan_names_the_new_one_and_works(monkeypatch, capsys):
    monkeypatch.setattr(sys, 'argv', ['plan_scan', '--help'])
    assert plan_scan.main() == 0
    out, err = capsys.readouterr()
    assert '--timing-error' in out
    assert 'ros2 run nodlidar_planner plan_scan' in err
