"""The points of a scan from the pitch of its beams."""

from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.clouds.points import place, points_of


def assemble(beams, start_ns, ranges, pitch, *more, **options):
    return points_of(place(beams, ranges, pitch), beams, start_ns, *more, **options)


def assembled_of(scan, beams, pitch):
    """Return a scan as the pipeline assembles it without mixed pixels and odometry."""
    placed = place(beams, scan.ranges, pitch)
    points = points_of(placed, beams, scan.stamp_ns)
    return Assembled(scan, beams, pitch, placed, points, [points])
