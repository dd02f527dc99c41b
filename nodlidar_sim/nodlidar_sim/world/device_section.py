"""The sections `lidar` and `servo` of a scene: a set by name or path, and what differs."""

from __future__ import annotations

from dataclasses import Field, fields
from typing import Any, Generic, TypeVar

from nodlidar_sim.world import shipped
from nodlidar_sim.world.lidar_parameters import LidarParameters
from nodlidar_sim.world.section import Section
from nodlidar_sim.world.servo.parameters import ServoParameters

_MOST = 1e6  # magnitude of a value, in its unit
_Parameters = TypeVar('_Parameters')


class DeviceSection(Generic[_Parameters]):
    """The sections and the sets of a device; a set is in the folder `<device>s` of the package.

    The key `model` of a section names a set of the package, or another one by the path of its YAML
    file. The other keys are those of the parameters, and override the set.

    Parameters
    ----------
    device
        Key of the section.
    kind
        Dataclass of the parameters.
    """

    def __init__(self, device: str, kind: type[_Parameters]) -> None:
        self._device, self._kind, self._folder = device, kind, f'{device}s'
        self._fields: tuple[Field[Any], ...] = fields(kind)  # type: ignore[arg-type]

    def names(self) -> list[str]:
        """Return the names of the package's sets."""
        return shipped.names(self._folder)

    def read(self, scene: Section) -> _Parameters | None:
        """Return the parameters of a scene; None if it has no such section.

        Raises
        ------
        SceneError
            If a key is unknown, or a value of a wrong type or out of its range.
        YamlError
            If a file cannot be read, or is no YAML.
        """
        if not scene.has(self._device):
            return None
        section = scene.section(self._device)
        values = self._set(section, section.text('model')) if section.has('model') else {}
        return self._parameters(section, values)

    def load(self, name_or_path: str) -> _Parameters:
        """Return the parameters of a set; raises as `read`."""
        content = {self._device: {'model': name_or_path}}
        parameters = self.read(Section(content, self._device))
        assert parameters is not None
        return parameters

    def _set(self, section: Section, model: str) -> dict[str, Any]:
        """Return the values of a set."""
        found = shipped.find(self._folder, model)
        if found is None:
            raise section.error('model', shipped.allowed(self._folder), model)
        values = self._values(found)
        self._parameters(found, {})
        return values

    def _parameters(self, section: Section, values: dict[str, Any]) -> _Parameters:
        with section.locating():
            parameters = self._kind(**{**values, **self._values(section)})
        section.close()
        return parameters

    def _values(self, section: Section) -> dict[str, Any]:
        """Return the values that a section has."""
        return {
            each.name: _value(section, each.name, each.default)
            for each in self._fields
            if section.has(each.name)
        }


def _value(section: Section, key: str, default: object) -> float | bool:
    if isinstance(default, bool):
        return section.truth(key, default)
    number = section.number(key, most=_MOST)
    if isinstance(default, int):
        if number != int(number):
            raise section.error(key, 'a whole number', number)
        return int(number)
    return number


_LIDAR = DeviceSection('lidar', LidarParameters)
lidar_parameters, load_lidar = _LIDAR.read, _LIDAR.load

_SERVO = DeviceSection('servo', ServoParameters)
servo_names, servo_parameters, load_servo = _SERVO.names, _SERVO.read, _SERVO.load
