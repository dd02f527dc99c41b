"""Imports go one way: between packages, between the folders of a package, and not upwards."""

import ast
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

WORKSPACE = Path(__file__).parents[2]
PACKAGES = sorted(path.parent.name for path in WORKSPACE.glob('nodlidar_*/setup.py'))

# Folders besides ros/ and commands/ that import modules of the folder above them.
UPWARD = {
    'nodlidar_assembler.calibration',  # reads the parameters, config.py
    'nodlidar_assembler.bags',  # runs scan_assembler.py, which lies in the package's root
}


@cache
def imported(path):
    """Return the dotted names that a module imports."""
    nodes = list(ast.walk(ast.parse(path.read_text())))
    names = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    for node in nodes:
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{path} has a relative import'
            names += [f'{node.module}.{alias.name}' for alias in node.names]
    return names


def folder_of(name):
    """Return the folder of a module, or of a name in it, with dots."""
    package, *parts = name.split('.')
    folder = package
    for part in parts:
        if not (WORKSPACE / package / f'{folder}.{part}'.replace('.', '/')).is_dir():
            break
        folder += f'.{part}'
    return folder


def folders(package):
    """Return the folders of its own package that each folder imports from."""
    graph = {}
    for path in (WORKSPACE / package / package).rglob('*.py'):
        module = '.'.join(path.relative_to(WORKSPACE / package).with_suffix('').parts)
        names = [name for name in imported(path) if name.split('.')[0] == package]
        folder = folder_of(module)
        graph.setdefault(folder, set()).update(map(folder_of, names))
    return {folder: targets - {folder} for folder, targets in graph.items()}


def test_packages_do_not_import_each_other_in_a_circle():
    graph = {
        package: {
            name.split('.')[0]
            for path in (WORKSPACE / package / package).rglob('*.py')
            for name in imported(path)
        }
        - {package}
        for package in PACKAGES
    }
    TopologicalSorter(graph).prepare()


@pytest.mark.parametrize('package', PACKAGES)
def test_folders_do_not_import_each_other_in_a_circle(package):
    TopologicalSorter(folders(package)).prepare()


@pytest.mark.parametrize('package', PACKAGES)
def test_no_folder_but_ros_and_commands_imports_one_above_it(package):
    upward = {
        folder
        for folder, targets in folders(package).items()
        if any(folder.startswith(f'{target}.') for target in targets)
    }
    upward -= {f'{package}.ros', f'{package}.commands'}
    assert upward == {folder for folder in UPWARD if folder.startswith(f'{package}.')}
