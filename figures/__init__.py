"""The drawings of the pages: figures of the publication, computed again, and our own."""

import matplotlib

matplotlib.use('Agg')  # into files, without a display
