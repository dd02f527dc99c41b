"""The findings on the terminal, and as JSON."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
import json

from nodlidar_bringup.checks.finding import Finding, Level
from rich.console import Console
from rich.table import Table
from rich.text import Text

_MARKS = {
    Level.GOOD: ('ok', 'green'),
    Level.UNKNOWN: ('?', 'cyan'),
    Level.WARNING: ('warning', 'yellow'),
    Level.FAULT: ('FAULT', 'bold red'),
}


@dataclass(frozen=True, slots=True)
class Section:
    """The findings of one subject."""

    name: str
    findings: Sequence[Finding]


def faults(sections: Sequence[Section]) -> list[Finding]:
    """Return what is wrong."""
    return [
        finding
        for section in sections
        for finding in section.findings
        if finding.level == Level.FAULT
    ]


def print_sections(sections: Sequence[Section], console: Console) -> None:
    """Print all findings with their remedies, and a sum."""
    for section in sections:
        if not section.findings:
            continue
        console.print(Text(section.name, style='bold'))
        table = Table.grid(padding=(0, 1))
        for finding in section.findings:
            mark, style = _MARKS[finding.level]
            table.add_row('', Text(mark, style=style), finding.text)
            if finding.remedy:
                table.add_row('', '', Text(f'-> {finding.remedy}', style='bold'))
        console.print(table)
    findings = [finding for section in sections for finding in section.findings]
    if any(command in each.remedy for each in findings for command in ('ros2 topic', 'tf2_ros')):
        console.print(
            '`ros2 topic` and `tf2_echo` come with an installed ROS; without one, see rates and '
            'diagnostics by view:=web of the launch'
        )
    levels = [finding.level for finding in findings]
    count, warnings = levels.count(Level.FAULT), levels.count(Level.WARNING)
    console.print(f'faults: {count}, warnings: {warnings}, findings: {len(levels)}')


def as_json(sections: Sequence[Section]) -> str:
    """Return all findings as a JSON object, by subject."""
    content = {
        section.name: [
            asdict(finding) | {'level': finding.level.name.lower()} for finding in section.findings
        ]
        for section in sections
    }
    return json.dumps({'faults': len(faults(sections)), 'subjects': content}, indent=2)
