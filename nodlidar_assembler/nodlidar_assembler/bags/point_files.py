"""Writes clouds into one PLY or PCD file, one by one: only one is held."""

from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from nodlidar_assembler.clouds.origins import OF_ODOMETRY
from nodlidar_assembler.clouds.points import Points
from nodlidar_common.errors import NodlidarError
from nodlidar_common.stamps import NS_PER_S
import numpy as np

# Packed and little-endian, as both formats are.
RECORD = np.dtype(
    [
        *((name, '<f4') for name in ('x', 'y', 'z', 'intensity')),
        ('time', '<f8'),
        ('ring', '<u2'),
    ]
)
RECORD_WITH_SIGMA = np.dtype([*RECORD.descr, ('sigma', '<f4')])
# The header states the number of points, known last: it is written into space left for it.
_HEADER_LENGTH = 1024
_PLY_TYPES = {'f4': 'float', 'f8': 'double', 'u2': 'uint16'}

Record = np.dtype[np.void]
Header = Callable[[Record, int, list[str], int], bytes]


class OutputError(NodlidarError):
    """A file that cannot be written, or cannot hold the clouds."""


class PointFile:
    """A file of points: x y z [m], intensity, time [s] since the first point, ring, maybe sigma.

    All are in the frame of the first cloud, relative to its origin.

    Parameters
    ----------
    path
        File to write.
    header
        Returns the header for records, their number, notes and a length [bytes].
    """

    def __init__(self, path: Path, header: Header) -> None:
        self._file: BinaryIO = path.open('wb')
        self._file.write(b' ' * _HEADER_LENGTH)
        self._header = header
        self._record, self._count = RECORD, 0
        self._start_ns = 0
        self._origin = OF_ODOMETRY
        self._frame_id = ''

    def write(self, cloud: Points, frame_id: str, now_ns: int) -> None:
        """Add a cloud."""
        if not self._count:
            self._start_ns, self._origin = int(cloud.time_ns[0]), cloud.origin
            self._frame_id = frame_id
            if 'sigma' in (cloud.data.dtype.names or ()):
                self._record = RECORD_WITH_SIGMA
        points = cloud.data_from(self._origin)
        records = np.empty(len(points), dtype=self._record)
        for name in set(self._record.names or ()) - {'time'}:
            records[name] = points[name]
        records['time'] = (cloud.time_ns - self._start_ns) / NS_PER_S
        self._file.write(records.tobytes())
        self._count += len(records)

    def close(self) -> None:
        """Write the header and close the file."""
        notes = [f'frame {self._frame_id}', f'time is in seconds since {self._start_ns} ns']
        if self._origin != OF_ODOMETRY:
            notes.append(
                'x y z count from {} {} {} m in the frame of odometry'.format(*self._origin)
            )
        self._file.seek(0)
        self._file.write(self._header(self._record, self._count, notes, _HEADER_LENGTH))
        self._file.close()

    def abandon(self) -> None:
        """Close the unfinished file."""
        self._file.close()


def ply_header(record: Record, count: int, notes: list[str], length: int) -> bytes:
    """Return the header of a binary PLY file, padded by a comment."""
    lines = ['ply', 'format binary_little_endian 1.0', *(f'comment {note}' for note in notes)]
    lines += [f'element vertex {count}']
    for name in record.names or ():
        lines.append(f'property {_PLY_TYPES[record[name].str[1:]]} {name}')
    return _padded([*lines, 'comment '], '\nend_header\n', length)


def pcd_header(record: Record, count: int, notes: list[str], length: int) -> bytes:
    """Return the header of a binary PCD file, padded by a comment."""
    names = record.names or ()
    types = [record[name] for name in names]
    lines = ['# .PCD v0.7 - Point Cloud Data file format', *(f'# {note}' for note in notes), '# ']
    rest = [
        '',
        'VERSION 0.7',
        f'FIELDS {" ".join(names)}',
        f'SIZE {" ".join(str(each.itemsize) for each in types)}',
        f'TYPE {" ".join(each.kind.upper() for each in types)}',
        f'COUNT {" ".join("1" for _ in names)}',
        f'WIDTH {count}',
        'HEIGHT 1',
        'VIEWPOINT 0 0 0 1 0 0 0',
        f'POINTS {count}',
        'DATA binary',
        '',
    ]
    return _padded(lines, '\n'.join(rest), length)


def _padded(lines: list[str], end: str, length: int) -> bytes:
    """Return lines and an end; the last line is a comment that is padded to the total length."""
    begin = '\n'.join(lines)
    room = length - len(begin.encode()) - len(end.encode())
    if room < 0:
        raise OutputError(f'a header of more than {length} bytes')
    return (begin + '.' * room + end).encode()
