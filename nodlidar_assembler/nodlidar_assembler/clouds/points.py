"""The points of a cloud: one NumPy record each, laid out as PointCloud2 carries them."""

import numpy as np

# Field order, types and the aligned 24-byte step are those that PCL-based consumers read fastest.
POINT = np.dtype(
    [
        ('x', np.float32),
        ('y', np.float32),
        ('z', np.float32),
        ('intensity', np.float32),
        ('time', np.float32),
        ('ring', np.uint16),
    ],
    align=True,
)

# Points in the frame of odometry. They have no `time`, by which a consumer would move them again.
MOVED_POINT = np.dtype(
    [(name, POINT[name]) for name in ('x', 'y', 'z', 'intensity', 'ring')], align=True
)
