"""What the beams meet and how it moves: scenes, shapes, rays, routes, motions, effects."""
