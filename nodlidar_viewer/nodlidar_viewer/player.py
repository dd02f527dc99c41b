"""The player of a recording: play, pause, speed, and a slider of the time."""

from viser import GuiApi

SPEEDS = ('0.2', '0.5', '1', '2', '5', '10')


class Player:
    """Moves through a recording; at its end it begins anew.

    Parameters
    ----------
    gui
        Of the page.
    duration
        Of the recording [s].
    """

    def __init__(self, gui: GuiApi, duration: float) -> None:
        self._duration, self._time = duration, 0.0
        with gui.add_folder('Recording', order=1.0):
            self._slider = gui.add_slider('Time [s]', 0.0, max(duration, 0.1), 0.1, 0.0)
            self._plays = gui.add_checkbox('Play', initial_value=True)
            self._speed = gui.add_dropdown('Speed', SPEEDS, initial_value='1')
        self._shown = 0.0

    def move(self, seconds: float) -> float:
        """Let so much real time pass [s]; return the instant of the recording [s]."""
        if self._slider.value != self._shown:  # somebody moved it
            self._time = float(self._slider.value)
        elif self._plays.value:
            self._time += seconds * float(self._speed.value)
            if self._time > self._duration:
                self._time = 0.0
        self._shown = round(self._time, 1)
        if self._slider.value != self._shown:
            self._slider.value = self._shown  # type: ignore[misc]
        return self._time
