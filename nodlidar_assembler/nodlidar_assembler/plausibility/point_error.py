"""The error of points by which signs are judged."""

DISTANCE = 2.0  # of the points whose error is stated [m]
LEAST_ERROR = 0.01  # m; steps of wheel encoders at a crawl are smaller
