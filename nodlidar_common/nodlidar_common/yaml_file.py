"""Strict reader of YAML files: parameters, scenes and routes."""

from pathlib import Path
import re
from typing import Any

from nodlidar_common.errors import NodlidarError, ParameterError
import yaml

LONGEST = 256 * 1024  # bytes, which take a few seconds; real files are much shorter


class YamlError(ParameterError):
    """A file that cannot be read or is not valid; `limit` is the problem.

    Parameters
    ----------
    file, problem
        Name of the file, and the problem.
    line
        Line of the problem, if known; the first is 1.
    """

    def __init__(self, file: str, problem: str, line: int | None = None) -> None:
        where = f"'{file}'" if line is None else f"'{file}', line {line}"
        NodlidarError.__init__(self, f'{where}: {problem}')
        self.key, self.limit, self.value = file, problem, line


def read_yaml(path: str | Path) -> object:
    """Return the content of a YAML file.

    Raises
    ------
    YamlError
        If it cannot be read, or is not valid as in :func:`parse_yaml`.
    """
    try:
        with open(path, 'rb') as file:
            data = file.read(LONGEST + 1)
        text = data.decode('utf-8-sig')
    except (OSError, ValueError) as error:
        problem = 'is not UTF-8 text' if isinstance(error, UnicodeDecodeError) else None
        raise YamlError(
            str(path), problem or getattr(error, 'strerror', None) or str(error)
        ) from error
    return parse_yaml(text, str(path))


def parse_yaml(text: str, file: str) -> object:
    """Return the content of the YAML text of a file.

    Aliases are refused, as in ROS: a short text with aliases can expand to any size.

    Raises
    ------
    YamlError
        If it is not YAML, too long, nested too deeply, or has an alias or a duplicate key.
    """
    if len(text) > LONGEST:
        raise YamlError(file, f'has more than {LONGEST} bytes')
    try:
        return yaml.load(text, _StrictLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = None if mark is None else mark.line + 1
        raise YamlError(file, error.problem or 'is not YAML', line) from error
    except RecursionError as error:
        raise YamlError(file, 'is nested too deeply') from error
    except Exception as error:  # PyYAML raises many kinds
        raise YamlError(file, 'is not YAML: ' + ' '.join(str(error).split())) from error


# Scalars without quotes, as of get_value in rcl_yaml_param_parser, but for hexadecimal floats and
# for numbers beyond the range of a float, which are texts there.
_TRUTHS = {
    form: truth
    for truth, words in ((True, 'y yes true on'), (False, 'n no false off'))
    for word in words.split()
    for form in (word, word.capitalize(), word.upper())
}
_INTEGERS = {10: '[1-9][0-9]*', 8: '0[0-7]*', 16: '0[xX][0-9a-fA-F]+'}  # by base
_FLOAT = re.compile(
    r'[-+]?(([0-9]+\.?[0-9]*|\.[0-9]+)(e[-+]?[0-9]+)?|inf(inity)?|nan)', re.IGNORECASE
)
_DOTTED = re.compile(r'[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)')


def _value(text: str) -> bool | int | float | str | None:
    if not text or text in _TRUTHS:
        return _TRUTHS.get(text)  # None for no text, which ROS refuses
    for base, pattern in _INTEGERS.items():
        if re.fullmatch(f'[-+]?{pattern}', text) and -(2**63) <= int(text, base) < 2**63:
            return int(text, base)
    if _FLOAT.fullmatch(text):
        return float(text)
    return float(text.replace('.', '')) if _DOTTED.fullmatch(text) else text


_STR = 'tag:yaml.org,2002:str'


class _StrictLoader(yaml.BaseLoader):
    """Ignores all tags but that of a text, as ROS does."""

    DEFAULT_SCALAR_TAG = ''  # type: ignore[misc]  # unlike the tag of a text

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            parser: Any = self
            mark = parser.peek_event().start_mark
            raise yaml.composer.ComposerError(None, None, 'aliases are not allowed', mark)
        return super().compose_node(parent, index)

    def construct_scalar(self, node: yaml.ScalarNode) -> Any:
        is_text = node.tag == _STR or node.style in ('"', "'")
        return node.value if is_text else _value(node.value)

    def construct_mapping(
        self, node: yaml.MappingNode, deep: bool = False
    ) -> dict[object, object]:
        keys: set[object] = set()
        for key_node, _ in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                continue  # the constructor refuses other keys
            key_node.tag, key = _STR, key_node.value  # in ROS, `on: 1` sets 'on'
            if key in keys:
                raise yaml.constructor.ConstructorError(
                    None, None, f'the key {key!r} comes twice', key_node.start_mark
                )
            keys.add(key)
        return dict(super().construct_mapping(node, deep))
