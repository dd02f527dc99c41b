"""Who walked by is not on the map; what stands is."""

from nodlidar_mapper.geometry.poses import planar
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.output.lasting import lasting_surface, ranges_beyond
import numpy as np
from rooms import keyframe_of

ANGLES = np.radians(np.arange(-40.0, 40.0, 0.5))
SLOPES = np.arange(-0.25, 0.25, 0.02)


def seen_from(x, person_at=None):
    """Return a keyframe at x that sees a wall at x = 4 m, and a person before it."""
    grid = np.stack(np.meshgrid(ANGLES, SLOPES), axis=-1).reshape(-1, 2)
    far = np.full(len(grid), 4.0 - x)
    hidden = np.zeros(len(grid), dtype=bool)
    if person_at is not None:
        hidden = np.abs(np.tan(grid[:, 0])) * (person_at - x) < 0.25
        hidden &= np.abs(grid[:, 1]) < 0.1
        far = np.where(hidden, person_at - x, far)
    points = np.stack([far, far * np.tan(grid[:, 0]), far * grid[:, 1]], axis=1)
    surface = Surface(points, np.tile([-1.0, 0.0, 0.0], (len(points), 1)))
    return keyframe_of(points, planar(x, 0.0, 0.0), surface)


def test_a_person_goes_and_the_wall_stays():
    keyframes = [seen_from(0.0, 2.0), seen_from(0.2), seen_from(0.4), seen_from(0.6)]
    x = lasting_surface(keyframes).points[:, 0]
    assert (np.abs(x - 4.0) < 1e-9).all()
    everything = sum(len(each.cloud.points) for each in keyframes)
    on_wall = sum((np.abs(k.placed_cloud.points[:, 0] - 4.0) < 1e-9).sum() for k in keyframes)
    assert len(x) == on_wall < everything


def share_of_the_person_kept(keyframes):
    kept = lasting_surface(keyframes).points
    person = np.abs(kept[:, 0] - 2.0) < 1e-9
    everything = sum((np.abs(k.placed_cloud.points[:, 0] - 2.0) < 1e-9).sum() for k in keyframes)
    return person.sum() / everything


def test_what_stands_before_a_wall_stays():
    assert share_of_the_person_kept([seen_from(x, 2.0) for x in (0.0, 0.2, 0.4, 0.6)]) > 0.95


def test_a_wall_of_few_points_has_no_holes():
    y, z = np.meshgrid(np.arange(-0.5, 0.55, 0.1), np.arange(-0.5, 0.55, 0.1))
    wall = np.stack([np.ones(y.size), y.ravel(), z.ravel()], axis=1)
    rng = np.random.default_rng(0)
    between = np.column_stack([np.full(50, 0.5), rng.uniform(-0.22, 0.22, (50, 2))])
    found = ranges_beyond(between, wall)
    assert np.abs(found - np.linalg.norm(between, axis=1)).max() < 0.1  # twice as far is the wall
    assert np.isinf(ranges_beyond(-between, wall)).all()
    assert np.isinf(ranges_beyond(between, wall[:0])).all()
    before = np.vstack([wall, 0.8 * wall])
    assert (ranges_beyond(between, before) < found - 0.1).all()


def test_what_more_keyframes_see_than_see_through_stays():
    """As a thing that was moved there meanwhile, or that is thin."""
    keyframes = [seen_from(0.1 * k, 2.0 if k < 4 else None) for k in range(7)]
    assert share_of_the_person_kept(keyframes) > 0.9
