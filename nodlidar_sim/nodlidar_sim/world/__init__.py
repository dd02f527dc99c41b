"""The simulated world: scenes, shapes, rays, routes, motions, effects."""
