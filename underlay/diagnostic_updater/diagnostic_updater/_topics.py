"""Tasks that watch a topic's frequency and stamps."""

from diagnostic_updater._monitors import FrequencyStatus, TimeStampStatus
from diagnostic_updater._tasks import CompositeDiagnosticTask
from rclpy.time import Time


class HeaderlessTopicDiagnostic(CompositeDiagnosticTask):
    """Watches a topic's frequency; adds itself to the Updater `diag`."""

    def __init__(self, name, diag, freq):
        super().__init__(name + ' topic status')
        self.diag = diag
        self.freq = FrequencyStatus(freq)
        self.addTask(self.freq)
        diag.add(self)

    def tick(self):
        """Count a message."""
        self.freq.tick()

    def clear_window(self):
        """Forget what was counted."""
        self.freq.clear()


class TopicDiagnostic(HeaderlessTopicDiagnostic):
    """Watches a topic's frequency and how old its stamps are."""

    def __init__(self, name, diag, freq, stamp):
        super().__init__(name, diag, freq)
        self.stamp = TimeStampStatus(stamp)
        self.addTask(self.stamp)

    def tick(self, stamp):
        """Count a message and look at its stamp."""
        self.stamp.tick(stamp)
        super().tick()


class DiagnosedPublisher(TopicDiagnostic):
    """A publisher that watches what goes through it."""

    def __init__(self, pub, diag, freq, stamp):
        super().__init__(pub.topic_name, diag, freq, stamp)
        self.publisher = pub

    def publish(self, message):
        """Publish a message with a header."""
        self.tick(Time.from_msg(message.header.stamp))
        self.publisher.publish(message)
