"""Tasks that watch how often something happens and how old its stamps are."""

from math import inf
import threading

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater._tasks import DiagnosticTask
from rclpy.clock import Clock, ClockType


def _now_ns():
    return Clock(clock_type=ClockType.ROS_TIME).now().nanoseconds


class FrequencyStatusParam:
    """What a frequency must be: from `min` less to `max` more a `tolerance` (a fraction).

    `freq_bound` is a dictionary of 'min' and, if there is one, 'max' [Hz], read at each update;
    `window_size` is the number of updates that the frequency is taken over.
    """

    def __init__(self, freq_bound, tolerance=0.1, window_size=5):
        self.freq_bound = freq_bound
        self.tolerance = tolerance
        self.window_size = window_size


class FrequencyStatus(DiagnosticTask):
    """Watches the frequency of calls of :meth:`tick`."""

    def __init__(self, params, name='FrequencyStatus'):
        super().__init__(name)
        self.params = params
        self.lock = threading.Lock()
        self.clear()

    def clear(self):
        """Forget what was counted."""
        with self.lock:
            self.count = 0
            # Number of events and time at each of the last updates, the oldest first.
            self._window = [(0, _now_ns())] * self.params.window_size

    def tick(self):
        """Count an event."""
        with self.lock:
            self.count += 1

    def run(self, stat):
        """Report on the events within the window."""
        with self.lock:
            count_then, then_ns = self._window.pop(0)
            now_ns = _now_ns()
            self._window.append((self.count, now_ns))
            events = self.count - count_then
            window = (now_ns - then_ns) * 1e-9
            stat.add('Events in window', str(events))
            stat.add('Events since startup', str(self.count))
        frequency = events / window
        stat.summary(*self._judge(events, frequency))
        stat.add('Duration of window (s)', f'{window:f}')
        stat.add('Actual frequency (Hz)', f'{frequency:f}')
        self._add_limits(stat)
        return stat

    def _limits(self):
        bound, tolerance = self.params.freq_bound, self.params.tolerance
        return bound['min'] * (1 - tolerance), bound.get('max', inf) * (1 + tolerance)

    def _judge(self, events, frequency):
        lowest, highest = self._limits()
        if events == 0:
            return DiagnosticStatus.ERROR, 'No events recorded.'
        if frequency < lowest:
            return DiagnosticStatus.WARN, 'Frequency too low.'
        if frequency > highest:
            return DiagnosticStatus.WARN, 'Frequency too high.'
        return DiagnosticStatus.OK, 'Desired frequency met'

    def _add_limits(self, stat):
        bound = self.params.freq_bound
        lowest, highest = self._limits()
        if bound['min'] == bound.get('max'):
            stat.add('Target frequency (Hz)', f'{bound["min"]:f}')
        if bound['min'] > 0:
            stat.add('Minimum acceptable frequency (Hz)', f'{lowest:f}')
        if 'max' in bound:
            stat.add('Maximum acceptable frequency (Hz)', f'{highest:f}')


class TimeStampStatusParam:
    """How old a stamp may be when it is seen [s]; less than nothing is in the future."""

    def __init__(self, min_acceptable=-1, max_acceptable=5):
        self.min_acceptable = min_acceptable
        self.max_acceptable = max_acceptable


class TimeStampStatus(DiagnosticTask):
    """Watches how old the stamps given to :meth:`tick` are."""

    def __init__(self, params=None, name='Timestamp Status'):
        super().__init__(name)
        self.params = TimeStampStatusParam() if params is None else params
        self.lock = threading.Lock()
        self.early_count = self.late_count = self.zero_count = 0
        self._forget()

    def _forget(self):
        self._delays = []
        self.zero_seen = False

    def tick(self, stamp):
        """Look at a stamp: a ``rclpy.time.Time``, or a float in seconds."""
        seconds = stamp if isinstance(stamp, float) else stamp.nanoseconds * 1e-9
        with self.lock:
            if seconds == 0:
                self.zero_seen = True
            else:
                delay = (_now_ns() - seconds * 1e9) * 1e-9
                self._delays = [min([delay, *self._delays]), max([delay, *self._delays])]

    def run(self, stat):
        """Report on the stamps since the last report."""
        with self.lock:
            earliest, latest = self._delays or (0.0, 0.0)
            stat.summary(*self._judge(earliest, latest))
            self._forget()
        stat.add('Earliest timestamp delay:', f'{earliest:f}')
        stat.add('Latest timestamp delay:', f'{latest:f}')
        stat.add('Earliest acceptable timestamp delay:', f'{self.params.min_acceptable:f}')
        stat.add('Latest acceptable timestamp delay:', f'{self.params.max_acceptable:f}')
        stat.add('Late diagnostic update count:', str(self.late_count))
        stat.add('Early diagnostic update count:', str(self.early_count))
        stat.add('Zero seen diagnostic update count:', str(self.zero_count))
        return stat

    def _judge(self, earliest, latest):
        """Count every trouble and return the last one; a zero stamp alone counts as no data."""
        if not self._delays:
            return DiagnosticStatus.WARN, 'No data since last update.'
        verdict = DiagnosticStatus.OK, 'Timestamps are reasonable.'
        if earliest < self.params.min_acceptable:
            self.early_count += 1
            verdict = DiagnosticStatus.ERROR, 'Timestamps too far in future seen.'
        if latest > self.params.max_acceptable:
            self.late_count += 1
            verdict = DiagnosticStatus.ERROR, 'Timestamps too far in past seen.'
        if self.zero_seen:
            self.zero_count += 1
            verdict = DiagnosticStatus.ERROR, 'Zero timestamp seen.'
        return verdict


class Heartbeat(DiagnosticTask):
    """Says that the node is alive."""

    def __init__(self):
        super().__init__('Heartbeat')

    def run(self, stat):
        """Report OK."""
        stat.summary(DiagnosticStatus.OK, 'Alive')
        return stat
