"""What the last seconds of beams have covered, in the diagnostics."""

from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper, Updater
from nodlidar_assembler.runtime_coverage import Covered


class CoverageReport:
    """Tells coverage in the diagnostics.

    Parameters
    ----------
    updater
        The diagnostics.
    covered
        Gives what has been covered.
    """

    def __init__(self, updater: Updater, covered: Callable[[], Covered]) -> None:
        self._covered = covered
        updater.add('coverage', self._report)

    def _report(self, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        covered = self._covered()
        status.summary(DiagnosticStatus.OK, f'{covered.seen:.1%} of the cells seen')
        status.add('beams', str(covered.beams))
        status.add('share of cells seen', f'{covered.seen:.4f}')
        status.add('largest hole [rad]', f'{covered.hole:.4f}')
        status.add('share of repeats', f'{covered.repeats:.4f}')
        status.add('least share of repeats', f'{covered.least_repeats:.4f}')
        return status
