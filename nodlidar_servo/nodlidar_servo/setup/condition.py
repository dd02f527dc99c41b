"""What a servo is: its registers in words, and what is wrong with it."""

from collections.abc import Mapping
from dataclasses import dataclass

from nodlidar_servo.bus.packets import PROTOCOL_2
from nodlidar_servo.bus.replies import HARDWARE_ERRORS, status_names
from nodlidar_servo.models.models import MODELS, ServoModel
from nodlidar_servo.setup.errors import WrongModelError
from nodlidar_servo.setup.registers import registers_of
from nodlidar_servo.setup.search import Found

_DELAY_UNIT = 2  # us


@dataclass(frozen=True)
class Condition:
    """A servo's registers.

    Attributes
    ----------
    found
        Where it answers.
    values
        Its registers by name.
    status
        Status byte of the answer.
    """

    found: Found
    values: Mapping[str, int]
    status: int = 0

    @property
    def model(self) -> ServoModel:
        """The model; raises WrongModelError if the node drives none of that number."""
        number = self.values['model number']
        for model in MODELS.values():
            if model.number == number and model.table.packets is self.found.packets:
                return model
        known = ', '.join(MODELS)
        raise WrongModelError(
            f'the servo has the model number {number}: supported are {known}; nothing was changed'
        )

    @property
    def errors(self) -> int:
        """Status bits of its alarms."""
        if self.found.packets is PROTOCOL_2:
            return self.values['errors'] << HARDWARE_ERRORS
        return self.found.packets.alarms(self.status)

    def lines(self) -> list[tuple[str, str]]:
        """Return what it is, as names and texts."""
        values, model = self.values, self.model
        position = f'{values["position"]} of {model.ticks}'
        return [
            ('model', f'{model.name}, firmware {values["firmware"]}'),
            ('protocol', f'{self.found.packets.version:.1f}'),
            ('bit rate', f'{self.found.baud_rate} bit/s'),
            ('ID', str(self.found.servo_id)),
            ('return delay', f'{values["return delay"] * _DELAY_UNIT} us'),
            ('limits', f'{values["lower limit"]} to {values["upper limit"]}'),
            ('position', position),
            ('torque', 'on' if values['torque'] else 'off'),
            ('supply', f'{values["voltage"] / 10.0:.1f} V'),
            ('temperature', f'{values["temperature"]} deg C of at most {values["hottest"]}'),
            ('errors', status_names(self.errors) or 'none'),
        ]

    def faults(self) -> list[str]:
        """Return what keeps it from nodding, in sentences."""
        found = [text for text, is_wrong in self._checks() if is_wrong]
        if names := status_names(self.errors):
            found.append(f'the servo reports: {names}')
        return found

    def _checks(self) -> list[tuple[str, bool]]:
        values = self.values
        low, high, volts = values['lower limit'], values['upper limit'], values['voltage']
        table, least = registers_of(self.found.packets), values['lowest voltage']
        mode = values.get('operating mode')
        return [
            ('wheel mode: it turns without end', low == high == 0),
            (f'operating mode {mode}, not position control', mode != table.position_mode),
            ('its torque is on: it holds its position', bool(values['torque'])),
            (f'it does not answer all requests (return level {values["return level"]})',
             values['return level'] != table.reply_to_all),
            (f'its supply of {volts / 10.0:.1f} V is outside of {least / 10.0:.1f} to'
             f' {values["highest voltage"] / 10.0:.1f} V',
             not least <= volts <= values['highest voltage']),
        ]  # fmt: skip
