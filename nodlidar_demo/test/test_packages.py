"""What a release and colcon ask of every package of the workspace."""

from pathlib import Path
import re

from catkin_pkg.package import parse_package
from colcon_core.task.python.test import has_test_dependency
from colcon_python_setup_py.package_identification.python_setup_py import get_setup_information
import pytest

WORKSPACE = Path(__file__).parents[2]
PACKAGES = sorted(path.parent for path in WORKSPACE.glob('nodlidar_*/package.xml'))
IMPORT = re.compile(r'^ *(?:from|import) (nodlidar_\w+)', re.MULTILINE)
SCRIPT = re.compile(r"'(\w+) = ([\w.:]+)'")

of_every_package = pytest.mark.parametrize('folder', PACKAGES, ids=lambda folder: folder.name)


@of_every_package
def test_colcon_test_runs_the_tests_of_a_package_by_pytest(folder):
    if not (folder / 'test').is_dir():
        assert not (folder / 'setup.py').exists()
        return
    setup = get_setup_information(folder / 'setup.py')
    assert has_test_dependency(setup, 'pytest')


@of_every_package
def test_a_package_has_its_licence_and_is_valid(folder):
    warnings = []
    package = parse_package(folder, warnings=warnings)
    assert not warnings
    [licence] = package.licenses
    assert (folder / licence.file).read_text() == (WORKSPACE / 'LICENSE').read_text()


@of_every_package
def test_what_a_package_depends_on_can_be_installed_without_pip(folder):
    # The build farm refuses keys of pip: what only PyPI has is named where it is needed.
    package = parse_package(folder)
    assert not [d.name for d in [*package.exec_depends, *package.test_depends] if 'pip' in d.name]


@of_every_package
def test_a_package_names_the_packages_of_the_workspace_that_its_files_import(folder):
    package = parse_package(folder)
    here = {name for path in folder.rglob('*.py') for name in IMPORT.findall(path.read_text())}
    named = {depend.name for depend in [*package.exec_depends, *package.test_depends]}
    assert here - {folder.name} <= named


@of_every_package
def test_each_command_is_the_module_of_its_name(folder):
    """What `ros2 run` calls is a node in ros/, or main of that module in commands/."""
    setup = folder / 'setup.py'
    scripts = SCRIPT.findall(setup.read_text()) if setup.exists() else []
    started = {name for name, where in scripts if not where.startswith(f'{folder.name}.ros.')}
    modules = (folder / folder.name / 'commands').glob('*.py')
    commands = {path.stem for path in modules if 'def main(' in path.read_text()}
    assert started == commands
    entry_point = f'{folder.name}.commands.entry_points'
    assert {(name, f'{entry_point}:{name}') for name in started} <= set(scripts)


def test_a_robot_without_a_screen_needs_no_rviz():
    package = parse_package(WORKSPACE / 'nodlidar_bringup')
    assert 'rviz2' not in [depend.name for depend in package.exec_depends]


def test_no_timer_of_a_node_runs_on_a_clock_that_can_be_set():
    sources = [path for folder in PACKAGES for path in (folder / folder.name).rglob('*.py')]
    assert [path.name for path in sources if '.create_timer(' in path.read_text()] == ['steady.py']
