"""Diagnostic tasks: each fills in a status when it is run."""

from diagnostic_updater._status import DiagnosticStatusWrapper


class DiagnosticTask:
    """Something with a name that fills in a status; subclasses override :meth:`run`."""

    def __init__(self, name):
        self.name = name

    def getName(self):  # noqa: N802
        """Return the task's name."""
        return self.name

    def run(self, stat):
        """Fill in and return a DiagnosticStatusWrapper."""
        return stat


class FunctionDiagnosticTask(DiagnosticTask):
    """A task that is a function of the status, which it fills in and returns."""

    def __init__(self, name, fn):
        super().__init__(name)
        self.fn = fn

    def run(self, stat):
        """Call the function."""
        return self.fn(stat)


class CompositeDiagnosticTask(DiagnosticTask):
    """Several tasks that fill in one status, their summaries merged."""

    def __init__(self, name):
        super().__init__(name)
        self.tasks = []

    def addTask(self, t):  # noqa: N802
        """Add a task."""
        self.tasks.append(t)

    def run(self, stat):
        """Run the tasks, each on the summary that the status came with, and merge the results."""
        original, combined = DiagnosticStatusWrapper(), DiagnosticStatusWrapper()
        original.summary(stat)
        for task in self.tasks:
            stat.summary(original)
            stat = task.run(stat)
            combined.mergeSummary(stat)
        stat.summary(combined)
        return stat
