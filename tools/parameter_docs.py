"""Writes the documentation of parameters: each node's YAML file and the tables in the READMEs.

Names, defaults, units, ranges and descriptions stand once, in the dataclasses of the stages that
use them. `make docs` runs this; a test fails when a file is stale.
"""

from collections.abc import Iterable, Iterator
from dataclasses import Field, fields
import inspect
from pathlib import Path
import re
import textwrap
from typing import Any

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.profiles import ProfileConfig, PROFILES
from nodlidar_common.parameters import Limits, limits_of
from nodlidar_driver.config import LdrobotConfig, ScipConfig
from nodlidar_mapper.config import MapperConfig
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.joint_trajectory.trajectory_config import TrajectoryConfig
from nodlidar_sim.world.effects import Effects
from nodlidar_viewer.config import ViewerConfig
import yaml

WORKSPACE = Path(__file__).parents[1]
BY_PROFILE = {
    field.name: {name: getattr(config, field.name) for name, config in PROFILES.items()}
    for field in fields(AssemblerConfig)
}
# The parameters in which profiles differ.
GOVERNED = {key: values for key, values in BY_PROFILE.items() if len({*values.values()}) > 1}
NODES = {
    'assembler': (ProfileConfig, AssemblerConfig),
    'driver': (ScipConfig,),
    'ldrobot': (LdrobotConfig,),
    'servo': (ServoConfig,),
    'joint_trajectory': (TrajectoryConfig,),
    'mapper': (MapperConfig,),
    'viewer': (ViewerConfig,),
}
# Commented out in the YAML files, where they would override the profile, the file of the lidar's
# driver, or what the launch knows of the servo and of the place of the lidar.
LEFT_TO_LAUNCH = {
    'assembler': {
        'profile',
        *GOVERNED,
        'scan_delay',
        'last_beam_first',
        'samples_per_sweep',
        'steps_per_revolution',
        'max_nod_speed',
        'max_nod_acceleration',
        'sensor_height',
        'mount_tilt',
    },
    'driver': set(),
    'ldrobot': set(),
    'servo': {'feedback_rate'},
    'joint_trajectory': set(),
    'mapper': set(),
    'viewer': set(),
}
IN_PACKAGE_OF = {'joint_trajectory': 'servo', 'ldrobot': 'driver'}  # a second node of a package
WIDTH = 99


def owner(config_class: type, name: str) -> type:
    """Return the class that declares a field of a configuration."""
    classes = reversed(config_class.__mro__)
    return next(each for each in classes if name in inspect.get_annotations(each))


def stages(node: str) -> Iterator[tuple[str, list['Field[Any]']]]:
    """Yield the stages of a node, each as its title and its parameters."""
    for config_class in NODES[node]:
        by_owner: dict[type, list[Field[Any]]] = {}
        for field in fields(config_class):
            by_owner.setdefault(owner(config_class, field.name), []).append(field)
        for each, own in by_owner.items():
            yield inspect.getdoc(each) or '', own


def plain(value: object) -> object:
    """Return a default as a type of YAML."""
    return list(value) if isinstance(value, tuple) else value


def in_yaml(value: object) -> str:
    """Return a value as text in YAML."""
    text = yaml.safe_dump(plain(value), default_flow_style=True, width=1000)
    return text.removesuffix('\n').removesuffix('\n...')


def allowed(limits: Limits) -> str:
    """Return the allowed values in a few words; empty text if all are."""
    low, high = limits.minimum, limits.maximum
    if limits.choices or (low is None and high is None):
        return ', '.join(limits.choices)
    if high is None:
        return f'from {low:g}'
    return f'to {high:g}' if low is None else f'{low:g} to {high:g}'


def yaml_file(node: str) -> str:
    """Return a node's YAML file."""
    lines = [
        f'# Parameters of the {node} with their defaults. Written by `make docs` from the code.',
        '/**:',
        '  ros__parameters:',
    ]
    for about, own in stages(node):
        lines += ['', f'    # {about.rstrip(".").upper()}']
        for field in own:
            limits = limits_of(field)
            parts = [limits.unit, '' if limits.choices else allowed(limits)]
            remarks = ', '.join(filter(None, parts))
            text = f'{limits.description} [{remarks}].' if remarks else f'{limits.description}.'
            lines += textwrap.wrap(
                text, WIDTH, initial_indent='    # ', subsequent_indent='    # '
            )
            left = '# ' if field.name in LEFT_TO_LAUNCH[node] else ''
            lines.append(f'    {left}{field.name}: {in_yaml(field.default)}')
    return '\n'.join(lines) + '\n'


def table(node: str) -> str:
    """Return the tables of a node's parameters for its README."""
    tables = []
    for about, own in stages(node):
        tables.append(f'{about}\n\n{table_of(own)}')
    return '\n\n'.join(tables)


def table_of(own: Iterable['Field[Any]']) -> str:
    """Return a table with a row for each parameter."""
    lines = ['| parameter | default | unit | allowed | |', '| --- | --- | --- | --- | --- |']
    for field in own:
        limits = limits_of(field)
        live = ' (can change while the node runs)' if limits.live else ''
        lines.append(
            f'| `{field.name}` | `{in_yaml(field.default)}` | {limits.unit} | '
            f'{allowed(limits)} | {limits.description}{live} |'
        )
    return '\n'.join(lines)


def profile_table() -> str:
    """Return the table of the profiles for the README of the assembler."""
    rates = {
        path.stem: yaml.safe_load(path.read_text())['/**']['ros__parameters']['feedback_rate']
        for path in (WORKSPACE / 'nodlidar_bringup' / 'config' / 'profiles').glob('*.yaml')
    }
    names = sorted(rates, key=list(PROFILES).index)
    named = {f'`{name}`': values for name, values in GOVERNED.items()}
    rows = [f'| parameter | {" | ".join(names)} |', '| --- ' * (len(names) + 1) + '|']
    for name, values in (named | {'`feedback_rate` of the servo': rates}).items():
        rows.append(f'| {name} | ' + ' | '.join(f'`{in_yaml(values[n])}`' for n in names) + ' |')
    return '\n'.join(rows)


def folder_of(node: str) -> Path:
    """Return the folder of the package of a node."""
    return WORKSPACE / f'nodlidar_{IN_PACKAGE_OF.get(node, node)}'


def documents() -> dict[Path, str]:
    """Return the current text of all documents of parameters."""
    found = {}
    for node in NODES:
        folder = folder_of(node)
        found[folder / 'config' / f'{node}.yaml'] = yaml_file(node)
        readme = folder / 'README.md'
        text = found.get(readme) or readme.read_text()
        block = f'parameters of {node}' if node in IN_PACKAGE_OF else 'parameters'
        found[readme] = filled(text, block, table(node))
    readme = WORKSPACE / 'nodlidar_assembler' / 'README.md'
    found[readme] = filled(found[readme], 'profiles', profile_table())
    readme = WORKSPACE / 'nodlidar_sim' / 'README.md'
    found[readme] = filled(readme.read_text(), 'effects', table_of(fields(Effects)))
    return found


def filled(text: str, name: str, content: str) -> str:
    """Return a page with the named block replaced."""
    block = re.compile(rf'(<!-- {name} -->\n).*?(<!-- end -->)', re.DOTALL)
    assert block.search(text), f'no block <!-- {name} -->'
    return block.sub(lambda match: f'{match[1]}{content}\n{match[2]}', text)


def main() -> None:
    """Write all documents."""
    for path, text in documents().items():
        path.write_text(text)


if __name__ == '__main__':
    main()
