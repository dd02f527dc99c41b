"""Drives a simulated building and maps it, many times faster than real time.

Leaves in the output folder a bag of the drive, the map (map.ply, map.pgm, map.yaml,
keyframes.npz), the path, and a picture of the map beside the true floor plan.
"""

from collections.abc import Sequence
import sys

from nodlidar_common.command_line import run


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo; return the exit status."""

    def work() -> None:
        # Imported here, so that a missing package is reported in one line.
        from nodlidar_demo.mapped_drive import map_simulated_drive

        map_simulated_drive(argv, __doc__)

    return run('demo_mapping', work)


if __name__ == '__main__':
    sys.exit(main())
