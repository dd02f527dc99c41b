"""The YAML files of the package, by name, and others by their path."""

from functools import cache
from importlib import resources
from pathlib import Path

from nodlidar_common.yaml_file import parse_yaml, read_yaml
from nodlidar_sim.world.section import Section

_SUFFIX = '.yaml'


def names(folder: str) -> list[str]:
    """Return the names of the files in a folder of the package, without their suffix."""
    files = resources.files('nodlidar_sim').joinpath(folder).iterdir()
    return sorted(Path(f.name).stem for f in files if f.name.endswith(_SUFFIX))


def allowed(folder: str) -> str:
    """Return what `find` takes, as a phrase that follows 'must be'."""
    return f'one of {", ".join(names(folder))}, or a path that ends in {_SUFFIX}'


def find(folder: str, name_or_path: str | Path) -> Section | None:
    """Return the content of a file of the folder, or of the one at a path; None if it is neither.

    Raises
    ------
    SceneError
        If its content is no mapping.
    YamlError
        If the file cannot be read, or is no YAML.
    """
    if str(name_or_path) in names(folder):
        name = f'{name_or_path}{_SUFFIX}'
        return Section(_content(folder, name), name)
    path = Path(name_or_path)
    return Section(read_yaml(path), path.name) if path.suffix == _SUFFIX else None


@cache  # to read a scene takes as long as to build it; a Section never changes its content
def _content(folder: str, name: str) -> object:
    file = resources.files('nodlidar_sim').joinpath(folder) / name
    return parse_yaml(file.read_text(encoding='utf-8'), name)
