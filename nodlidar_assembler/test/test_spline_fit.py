"""The smoothing splines against the posterior of the same prior, computed directly."""

from nodlidar_assembler.clouds.spline_fit import (
    ACCELERATION,
    fit,
    KNOT,
    NU,
    RIDGE,
    ROUGHNESS,
    STRIDE,
    value,
)
import numpy as np
import pytest
from scipy.interpolate import BSpline

INTERVALS = 20
KNOTS = np.arange(-3, INTERVALS + 4, dtype=float)


def spline_of(coefficients):
    """Return the spline in knots, by the library."""
    return BSpline(KNOTS, coefficients, 3)


def some_samples():
    rng = np.random.default_rng(1)
    place = np.sort(rng.uniform(0.0, INTERVALS, 17))
    pitch = 0.3 * np.sin(place / 3.0) + rng.normal(0.0, 1e-3, len(place))
    intensity = ROUGHNESS * rng.uniform(0.5, 2.0, (len(ROUGHNESS), INTERVALS))
    noise = np.full((len(ROUGHNESS), 1), 2e-6)
    return place, pitch, noise, rng.uniform(0.2, 1.0, len(place)), intensity


def test_a_value_is_that_of_the_spline():
    coefficients = np.random.default_rng(2).normal(size=INTERVALS + 3)
    place = np.linspace(0.0, INTERVALS - 1e-9, 500)
    np.testing.assert_allclose(
        value(coefficients, place), spline_of(coefficients)(place), atol=1e-12
    )


def test_the_fit_is_the_posterior():
    place, pitch, noise, weight, intensity = some_samples()
    splines = fit(place, pitch, noise, weight, intensity)
    units = np.eye(INTERVALS + 3)
    basis = np.array([spline_of(unit)(place) for unit in units]).T
    middles = np.arange(INTERVALS) + 0.5
    jerk = np.array([spline_of(unit).derivative(3)(middles) for unit in units]).T / KNOT**3
    bends = np.diff(units, 2, axis=0) / KNOT**2 / ACCELERATION
    for k in range(len(ROUGHNESS)):
        information = (
            basis.T @ np.diag(weight / noise[k]) @ basis
            + jerk.T @ np.diag(KNOT / intensity[k]) @ jerk
            + bends.T @ bends
            + RIDGE * units
        )
        covariance = np.linalg.inv(information)
        mean = covariance @ basis.T @ (weight * pitch / noise[k])
        np.testing.assert_allclose(splines.coefficients[k], mean, atol=1e-9)
        np.testing.assert_allclose(splines.pitch[k], basis @ mean, atol=1e-9)
        variance = np.diag(basis @ covariance @ basis.T)
        np.testing.assert_allclose(splines.variance[k], variance, rtol=1e-6)
        hat = basis @ covariance @ basis.T @ np.diag(weight / noise[k])
        influence = [np.trace(hat[lag:, 3:9], offset=-3) for lag in range(4)]
        np.testing.assert_allclose(splines.influence(slice(3, 9), 3)[k], influence, rtol=1e-6)
        power = KNOT * ((jerk @ mean) ** 2 + np.diag(jerk @ covariance @ jerk.T))
        improved = (NU * ROUGHNESS[k] + power) / (NU + 1.0)
        expected = intensity[k] * (improved / intensity[k]) ** STRIDE
        np.testing.assert_allclose(splines.intensity[k], expected, rtol=1e-5)


def test_a_parabola_has_no_jerk_and_is_followed_exactly():
    place, _, noise, weight, intensity = some_samples()
    splines = fit(place, 0.1 + 0.02 * place - 1e-3 * place**2, noise, weight, intensity)
    np.testing.assert_allclose(splines.pitch[0], 0.1 + 0.02 * place - 1e-3 * place**2, atol=1e-5)


@pytest.mark.parametrize('count', [1, 2, 3])
def test_few_samples_still_determine_a_spline(count):
    place = np.linspace(1.5, 18.0, count)
    pitch = 0.01 * place
    splines = fit(
        place,
        pitch,
        np.full((len(ROUGHNESS), 1), 2e-6),
        np.ones(count),
        np.repeat(ROUGHNESS, INTERVALS, 1),
    )
    np.testing.assert_allclose(splines.pitch, np.tile(pitch, (len(ROUGHNESS), 1)), atol=1e-4)
