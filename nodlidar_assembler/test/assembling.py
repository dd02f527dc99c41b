"""The points of a scan from the pitch of its beams."""

from nodlidar_assembler.clouds.points import place, points_of


def assemble(beams, start_ns, ranges, pitch, *more, **options):
    return points_of(place(beams, ranges, pitch), beams, start_ns, *more, **options)
