"""The section `servo` of a scene: a set of parameters by name or path, and what differs."""

from __future__ import annotations

from dataclasses import fields
from importlib import resources
from pathlib import Path

from nodlidar_common.yaml_file import parse_yaml, read_yaml
from nodlidar_sim.world.section import Section
from nodlidar_sim.world.servo.parameters import ServoParameters

_SUFFIX = '.yaml'
_FOLDER = 'servos'

Values = dict[str, float | bool]


def servo_names() -> list[str]:
    """Return the names of the package's sets of parameters."""
    files = resources.files('nodlidar_sim').joinpath(_FOLDER).iterdir()
    return sorted(Path(f.name).stem for f in files if f.name.endswith(_SUFFIX))


def servo_parameters(scene: Section) -> ServoParameters | None:
    """Return the servo of a scene; None for the ideal one, of a scene without a `servo`.

    The key `model` names a set of the package, or another one by the path of its YAML file. The
    other keys are those of ServoParameters, and override the set.

    Raises
    ------
    SceneError
        If a key is unknown, or a value of a wrong type or out of its range.
    YamlError
        If a file cannot be read, or is no YAML.
    """
    if not scene.has('servo'):
        return None
    section = scene.section('servo')
    values = _set(section, section.text('model')) if section.has('model') else {}
    return _parameters(section, values)


def load_servo(name_or_path: str) -> ServoParameters:
    """Return the parameters of a set; raises as `servo_parameters`."""
    content = {'servo': {'model': name_or_path}}
    parameters = servo_parameters(Section(content, 'servo'))
    assert parameters is not None
    return parameters


def _set(section: Section, model: str) -> Values:
    """Return the values of a set."""
    if model in servo_names():
        file = resources.files('nodlidar_sim').joinpath(_FOLDER) / f'{model}{_SUFFIX}'
        name = model + _SUFFIX
        found = Section(parse_yaml(file.read_text(encoding='utf-8'), name), name)
    elif Path(model).suffix == _SUFFIX:
        found = Section(read_yaml(Path(model)), Path(model).name)
    else:
        limit = f'one of {", ".join(servo_names())}, or a path that ends in {_SUFFIX}'
        raise section.error('model', limit, model)
    values = _values(found)
    _parameters(found, {})
    return values


def _parameters(section: Section, values: Values) -> ServoParameters:
    with section.locating():
        parameters = ServoParameters(**{**values, **_values(section)})  # type: ignore[arg-type]
    section.close()
    return parameters


def _values(section: Section) -> Values:
    """Return the values that a section has."""
    return {
        field.name: _value(section, field.name, field.default)
        for field in fields(ServoParameters)
        if section.has(field.name)
    }


def _value(section: Section, key: str, default: object) -> float | bool:
    if isinstance(default, bool):
        return section.truth(key, default)
    number = section.number(key)
    if isinstance(default, int):
        if number != int(number):
            raise section.error(key, 'a whole number', number)
        return int(number)
    return number
