"""Measures ranges as a lidar with errors does, for the fast mode and the emulator alike."""

from __future__ import annotations

from nodlidar_common.arrays import Array, Mask, Times
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.lidar_parameters import LidarParameters
from nodlidar_sim.world.raycast import Echoes
from nodlidar_sim.world.spot import cone, disc, echo_of, merged, rim, Spots, straddles
from nodlidar_sim.world.world import World
import numpy as np
from numpy.typing import NDArray

_RIM = rim(6)
_DISC = disc(64)
_TOLERANCE = 1e-3  # m: resolution of the lidar


class Lidar:
    """A lidar in a world; call `ranges` in the order of beams.

    Parameters
    ----------
    parameters
        Its errors.
    world
        What it sees.
    start_ns
        When the recording begins, or the device is powered up [ns].
    seed
        Of its random errors, which are the same however the beams are divided into calls.
    """

    def __init__(
        self, parameters: LidarParameters, world: World, start_ns: int, seed: int
    ) -> None:
        self._parameters, self._world, self._start_ns = parameters, world, start_ns
        self._noise, self._scatter = np.random.default_rng(seed).spawn(2)

    def ranges(self, times_ns: Times, azimuth: Array) -> Array:
        """Return the measured ranges [m], shape (n,): inf without a surface, NaN if lost.

        Times [ns] and azimuths [rad] as in `World.ranges`.
        """
        parameters = self._parameters
        if parameters.ideal:
            return self._world.ranges(times_ns, azimuth)
        ranges, echo = self._spots(times_ns, azimuth)
        if parameters.noise or parameters.noise_growth:
            normal = self._noise.standard_normal(ranges.shape)
            sigma = parameters.sigma(np.where(np.isfinite(ranges), ranges, 0.0))
            ranges = ranges + sigma * normal
        if parameters.offset:
            ranges = ranges + parameters.offset
        if parameters.warm_up_drift:
            ranges = ranges + parameters.drift((times_ns - self._start_ns) / NS_PER_S)
        return np.where(self._lost(echo), np.nan, ranges)

    def _lost(self, echo: Array) -> Mask:
        """Return which beams that hit a surface return too little."""
        parameters = self._parameters
        received = echo
        if parameters.least_echo and parameters.echo_scatter:
            normal = self._scatter.standard_normal(echo.shape)
            received = echo * (1.0 + parameters.echo_scatter * normal)
        return np.asarray((echo > 0.0) & (received < parameters.least_echo))

    def _spots(self, times_ns: Times, azimuth: Array) -> Spots:
        """Return what the beams return, before noise and drift."""
        parameters, world = self._parameters, self._world
        if not parameters.senses_echoes:
            ranges = world.ranges(times_ns, azimuth, parameters.elevation)
            return Spots(ranges, np.zeros_like(ranges))
        origins, directions = world.rays(times_ns, azimuth, parameters.elevation)
        centre = world.echoes(origins, directions, times_ns)
        ranges = centre.ranges + parameters.bias(centre.brightness, centre.cosine)
        echo = echo_of(centre)
        if parameters.divergence:
            which = self._straddling(origins, directions, times_ns, centre)
            if len(which):
                rays = origins[which], directions[which], times_ns[which]
                ranges[which], echo[which] = self._parts(*rays)
        return Spots(ranges, echo)

    def _straddling(
        self, origins: Array, directions: Array, times_ns: Times, centre: Echoes
    ) -> NDArray[np.intp]:
        """Return the numbers of the beams whose spots cover more than one plane."""
        half_angle = self._parameters.divergence / 2.0
        rays, stamps = _spread(origins, cone(directions, half_angle, _RIM), times_ns)
        around = self._world.distances(*rays, stamps).reshape(len(origins), -1)
        return np.flatnonzero(straddles(centre.ranges, around, half_angle, _TOLERANCE))

    def _parts(self, origins: Array, directions: Array, times_ns: Times) -> Spots:
        """Return what beams return all over their spots."""
        within = cone(directions, self._parameters.divergence / 2.0, _DISC)
        rays, stamps = _spread(origins, within, times_ns)
        found = self._world.echoes(*rays, stamps)
        shape = within.shape[:2]
        echoes = Echoes(*(np.reshape(values, shape) for values in found))
        return merged(echoes, self._parameters.bias(echoes.brightness, echoes.cosine))


def _spread(origins: Array, rays: Array, times_ns: Times) -> tuple[tuple[Array, Array], Times]:
    """Return origins and directions (n * k, 3) and times of rays (n, k, 3) in n cones."""
    count = rays.shape[1]
    return (np.repeat(origins, count, axis=0), rays.reshape(-1, 3)), np.repeat(times_ns, count)
