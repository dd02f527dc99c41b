"""Drawings as SVG in millimetres, which print at full size."""

from collections.abc import Sequence
import math
from pathlib import Path
from xml.etree import ElementTree

Point = tuple[float, float]

_THIN = 0.25
_ARROW = 1.5


class Drawing:
    """A page on which shapes are drawn; x to the right, y down [mm].

    Parameters
    ----------
    width, height
        Size of the page.
    """

    def __init__(self, width: float, height: float) -> None:
        self.root = ElementTree.Element(
            'svg',
            {
                'xmlns': 'http://www.w3.org/2000/svg',
                'width': f'{width:g}mm',
                'height': f'{height:g}mm',
                'viewBox': f'0 0 {width:g} {height:g}',
                'font-family': 'sans-serif',
            },
        )
        self._add('rect', width=f'{width:g}', height=f'{height:g}', fill='white')

    def save(self, path: Path) -> None:
        """Write the page into a file."""
        ElementTree.indent(self.root)
        path.write_bytes(ElementTree.tostring(self.root, encoding='utf-8') + b'\n')

    def polygon(self, points: Sequence[Point]) -> None:
        """Draw a closed outline."""
        self._shape('polygon', points=' '.join(f'{x:.2f},{y:.2f}' for x, y in points))

    def rectangle(self, x: float, y: float, width: float, height: float) -> None:
        """Draw a rectangle by its upper left corner."""
        self.polygon([(x, y), (x + width, y), (x + width, y + height), (x, y + height)])

    def circle(self, x: float, y: float, radius: float) -> None:
        """Draw a circle."""
        self._shape('circle', cx=f'{x:.2f}', cy=f'{y:.2f}', r=f'{radius:.2f}')

    def slot(self, begin: Point, end: Point, width: float) -> None:
        """Draw a slot by the centres of its ends."""
        angle = math.atan2(end[1] - begin[1], end[0] - begin[0])
        dx, dy = -math.sin(angle) * width / 2.0, math.cos(angle) * width / 2.0
        arc = f'A {width / 2.0:.2f} {width / 2.0:.2f} 0 0 0'
        self._shape(
            'path',
            d=f'M {begin[0] + dx:.2f} {begin[1] + dy:.2f} L {end[0] + dx:.2f} {end[1] + dy:.2f} '
            f'{arc} {end[0] - dx:.2f} {end[1] - dy:.2f} '
            f'L {begin[0] - dx:.2f} {begin[1] - dy:.2f} '
            f'{arc} {begin[0] + dx:.2f} {begin[1] + dy:.2f} Z',
        )

    def line(
        self, begin: Point, end: Point, *, dashed: bool = False, width: float = _THIN
    ) -> None:
        """Draw a line."""
        places = dict(zip(('x1', 'y1', 'x2', 'y2'), (*begin, *end), strict=True))
        style = {'stroke-dasharray': '2 1'} if dashed else {}
        style |= {name: f'{value:.2f}' for name, value in places.items()}
        self._shape('line', width=width, **style)

    def text(self, x: float, y: float, words: str, size: float = 3.5, turn: float = 0.0) -> None:
        """Write a line of text, turned counter-clockwise by an angle [deg]."""
        style = {'x': f'{x:.2f}', 'y': f'{y:.2f}', 'font-size': f'{size:g}'}
        if turn:
            style['transform'] = f'rotate({-turn:g} {x:.2f} {y:.2f})'
        self._add('text', **style).text = words

    def size(self, begin: Point, end: Point, value: float) -> None:
        """Draw a level or upright line with arrows between two points, and a length beside it."""
        self.line(begin, end)
        for tip, other in ((begin, end), (end, begin)):
            angle = math.atan2(other[1] - tip[1], other[0] - tip[0])
            for turn in (-0.4, 0.4):
                way = math.cos(angle + turn), math.sin(angle + turn)
                self.line(tip, (tip[0] + _ARROW * way[0], tip[1] + _ARROW * way[1]))
        x, y = (begin[0] + end[0]) / 2.0, (begin[1] + end[1]) / 2.0
        upright = begin[0] == end[0]
        self.text(x - 1.0, y - (0.0 if upright else 1.0), f'{value:.1f}', turn=90.0 * upright)

    def _shape(self, tag: str, width: float = _THIN, **style: str) -> None:
        self._add(
            tag, **{'fill': 'none', 'stroke': 'black', 'stroke-width': f'{width:g}'}, **style
        )

    def _add(self, tag: str, **attributes: str) -> ElementTree.Element:
        return ElementTree.SubElement(self.root, tag, attributes)
