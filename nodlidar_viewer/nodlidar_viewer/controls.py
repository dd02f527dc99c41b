"""The controls of the page: the nod, and start and stop of the devices."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
import math
from typing import Any, Protocol

from nodlidar_assembler.control.nod_config import NOD_MODES, NodConfig
from nodlidar_assembler.profiles import PROFILES
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check, limits_of
from nodlidar_viewer.choosing import samples_for
import viser

Values = Mapping[str, Any]
NOD = tuple(field.name for field in fields(NodConfig))
ADAPTS, PROFILE = 'adapt_limits', 'profile'
APPLIED = 'applied'
_ALLOWED: Values = {field.name: limits_of(field) for field in fields(NodConfig)}
WIDEST = float(math.ceil(math.degrees(_ALLOWED['pitch_max'].maximum)))  # end of the slider [deg]


class Commands(Protocol):
    """What the controls ask for; answers come later, in words."""

    def change(self, values: Values, answer: Callable[[str], object]) -> None:
        """Set parameters of the assembler, all or none."""

    def switch(self, on: bool, answer: Callable[[str], object]) -> None:
        """Start or stop servo and lidar."""


class Controls:
    """The controls in one browser.

    Parameters
    ----------
    client
        The browser.
    values
        Parameters of the assembler, by name: those of NOD, ADAPTS and PROFILE.
    commands
        Carries out.
    """

    def __init__(self, client: viser.ClientHandle, values: Values, commands: Commands) -> None:
        self._values, self._commands = dict(values), commands
        config, gui = self._config({}), client.gui
        with gui.add_folder('Control', order=1.0):
            self._limits = gui.add_multi_slider(
                'Limits [°]',
                -WIDEST,
                WIDEST,
                0.5,
                (math.degrees(config.pitch_min), math.degrees(config.pitch_max)),
                min_range=1.0,
            )
            self._samples = gui.add_number('N_s', config.samples_per_sweep, min=1, step=1)
            self._mode = gui.add_dropdown('Mode', NOD_MODES, initial_value=config.nod_mode)
            self._adapts = gui.add_checkbox('Limits follow the range', bool(values[ADAPTS]))
            self._size = gui.add_number('Object [m]', config.object_size, min=0.02, step=0.01)
            self._distance = gui.add_number('at [m]', config.object_distance, min=0.05, step=0.1)
            self._profile = gui.add_dropdown(
                'Profile', tuple(PROFILES), initial_value=values[PROFILE]
            )
            choose = gui.add_button('Choose N_s for it', hint='the nod that sees it soonest')
            apply = gui.add_button('Apply')
            switch = gui.add_button_group('Devices', ('start', 'stop'))
            self._answer = gui.add_markdown('')
        self._shown = self._chosen()
        choose.on_click(lambda _: self._choose())
        apply.on_click(lambda _: self._apply())
        switch.on_click(lambda _: commands.switch(switch.value == 'start', self._say))

    def _say(self, text: str) -> None:
        self._answer.content = text

    def _chosen(self) -> dict[str, Any]:
        """Return what is set on the page."""
        low, high = (math.radians(limit) for limit in self._limits.value)
        return {
            'pitch_min': low,
            'pitch_max': high,
            'samples_per_sweep': int(self._samples.value),
            'nod_mode': self._mode.value,
            'object_size': float(self._size.value),
            'object_distance': float(self._distance.value),
            ADAPTS: self._adapts.value,
            PROFILE: self._profile.value,
        }

    def _config(self, chosen: Values) -> NodConfig:
        """Return the nod with changes; raises ParameterError."""
        config = NodConfig(**{name: chosen.get(name, self._values[name]) for name in NOD})
        check(config)
        return config

    def _choose(self) -> None:
        try:
            self._samples.value = samples_for(  # type: ignore[misc]
                self._config(self._chosen())
            )
        except ParameterError as error:
            self._say(str(error))

    def _apply(self) -> None:
        """Set what was changed here: the rest may have been changed elsewhere meanwhile."""
        chosen = self._chosen()
        changed = {name: value for name, value in chosen.items() if value != self._shown[name]}

        def answer(text: str) -> None:
            if text == APPLIED:
                self._shown = chosen
            self._say(text)

        if changed:
            self._commands.change(changed, answer)
        else:
            self._say('nothing was changed')
