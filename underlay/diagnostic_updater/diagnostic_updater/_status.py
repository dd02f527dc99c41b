"""A diagnostic status that is easy to fill in."""

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from underlay_refusal import Partial


class DiagnosticStatusWrapper(Partial, DiagnosticStatus):
    """A DiagnosticStatus message that tasks fill in."""

    def summary(self, lvl, msg):
        """Set level and message."""
        self.level = lvl
        self.message = msg

    def mergeSummary(self, lvl, msg):  # noqa: N802
        """Merge in another level and message.

        The higher level is kept. Messages of two OKs or of two troubles are joined by '; ', a
        trouble's message replaces that of an OK.
        """
        if (lvl > DiagnosticStatus.OK) == (self.level > DiagnosticStatus.OK):
            self.message = f'{self.message}; {msg}' if self.message else msg
        elif lvl > self.level:
            self.message = msg
        self.level = max(self.level, lvl)

    def add(self, key, val):
        """Add a key and its value, both strings."""
        self.values.append(KeyValue(key=key, value=val))
