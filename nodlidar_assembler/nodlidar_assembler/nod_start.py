"""The first nod: from the limits and N_s to a trajectory tied to the lidar's own revolution."""

from nodlidar_assembler.geometry import revolution_time, ScanGeometry
from nodlidar_common.nod import NodTrajectory, NS_PER_S


def first_nod(
    geometry: ScanGeometry,
    scan_stamp_ns: int,
    steps_per_revolution: int,
    pitch_min: float,
    pitch_max: float,
    samples_per_sweep: int,
) -> NodTrajectory:
    """Return the nod whose phase is half a sample at a beam of the given scan.

    It is tied to that scan and its rate of rotation; what the lidar's clock does later is not
    followed.

    With gcd(N_s, N_L) = 1, N_L even and the half-sample phase, the samples of N_s revolutions fall
    on all cells of the finest grid exactly once (docs/model.md, "The pattern").

    Parameters
    ----------
    geometry
        Of the scan; its rate of rotation defines the beam period T_s.
    scan_stamp_ns
        Instant of the scan's first beam [ns].
    steps_per_revolution
        N_L, dark steps counted.
    pitch_min, pitch_max
        Limits [rad].
    samples_per_sweep
        N_s.

    Raises
    ------
    ParameterError
        If limits or N_s make no nod.
    """
    beam_period = revolution_time(geometry) / steps_per_revolution
    return NodTrajectory(
        pitch_min=pitch_min,
        pitch_max=pitch_max,
        sweep_duration=samples_per_sweep * beam_period,
        samples_per_sweep=samples_per_sweep,
        reference_time_ns=scan_stamp_ns - round(0.5 * beam_period * NS_PER_S),
    )
