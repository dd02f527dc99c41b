"""A diagnostic status that is easy to fill in."""

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue


class DiagnosticStatusWrapper(DiagnosticStatus):
    """A DiagnosticStatus message with the calls that tasks fill it in with."""

    def summary(self, *args):
        """Set level and message: ``summary(level, message)`` or ``summary(status)``."""
        level, message = _level_and_message(args)
        self.level = level
        self.message = str(message)

    def clearSummary(self):  # noqa: N802
        """Set the level to OK and the message to nothing."""
        self.summary(DiagnosticStatus.OK, '')

    def mergeSummary(self, *args):  # noqa: N802
        """Merge in another summary, given as for :meth:`summary`.

        The higher level is kept. Messages of two OKs or of two troubles are joined by '; ', a
        trouble's message replaces that of an OK.
        """
        level, message = _level_and_message(args)
        if (level > DiagnosticStatus.OK) == (self.level > DiagnosticStatus.OK):
            self.message = f'{self.message}; {message}' if self.message else message
        elif level > self.level:
            self.message = message
        self.level = max(self.level, level)

    def add(self, key, val):
        """Add a key and its value, both strings."""
        self.values.append(KeyValue(key=key, value=val))


def _level_and_message(args):
    if len(args) == 1:
        return args[0].level, args[0].message
    level, message = args
    return level, message
