"""The figures of the publication that the sensor comes from, computed again."""

import matplotlib

matplotlib.use('Agg')  # into files, without a display
