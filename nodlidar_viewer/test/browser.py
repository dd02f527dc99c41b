"""A browser without a screen: speaks the protocol of viser over a real websocket."""

from contextlib import contextmanager
import time

import msgspec
import numpy as np
import viser
from viser._messages import GuiUpdateMessage, ViewerCameraMessage
from websockets.sync.client import connect
import zstandard

SEEN = ViewerCameraMessage(
    wxyz=(1.0, 0.0, 0.0, 0.0),
    position=(0.0, 0.0, 1.0),
    fov=1.0,
    near=0.01,
    far=100.0,
    image_height=480,
    image_width=640,
    look_at=(1.0, 0.0, 0.0),
    up_direction=(0.0, 0.0, 1.0),
)


class Browser:
    """Keeps the messages that the page was sent."""

    def __init__(self, connection):
        self._connection = connection
        self.messages = []
        self._send(SEEN)

    def _send(self, message):
        self._connection.send(msgspec.msgpack.encode(message.as_serializable_dict()))

    def set(self, label, value):
        """Set the input with a label, or press its button."""
        found = [m for m in self.messages if m.get('props', {}).get('label') == label]
        self._send(GuiUpdateMessage(found[-1]['uuid'], {'value': value}))

    def until(self, condition, meanwhile=lambda: None, timeout=15.0):
        """Receive messages until a condition holds, and do something meanwhile."""
        deadline = time.monotonic() + timeout
        while not condition():
            assert time.monotonic() < deadline, sorted({m['type'] for m in self.messages})
            meanwhile()
            try:
                data = self._connection.recv(timeout=0.05)
            except TimeoutError:
                continue
            self.messages.extend(_messages(data))

    def of(self, kind):
        """Return the messages of a kind, for example of point clouds."""
        return [m for m in self.messages if m['type'] == kind]

    def text(self):
        """Return all that the page says."""
        words = [str(m.get('props', m.get('updates', ''))) for m in self.messages]
        return '\n'.join(words)


def _messages(data):
    """Return the messages in a packet; arrays follow them, each at a multiple of 8 bytes."""
    offset = 16 + int.from_bytes(data[8:16], 'little')
    decoded = msgspec.msgpack.decode(zstandard.decompress(data[16:offset]))
    arrays = []
    for length in decoded['binaryBufferLengths']:
        offset += -offset % 8
        arrays.append(data[offset : offset + length])
        offset += length
    for message in decoded['messages']:
        for values in (message.get('props', {}), message.get('updates', {})):
            for name, value in values.items():
                if isinstance(value, dict) and '__binary_index' in value:
                    array = arrays[value['__binary_index']]
                    values[name] = np.frombuffer(array, dtype=value['dtype'])
    return decoded['messages']


@contextmanager
def browsing(address, **headers):
    """Open a page, whose address begins with http."""
    with connect(
        address.replace('http', 'ws', 1),
        subprotocols=[f'viser-v{viser.__version__}'],
        additional_headers=headers,
        max_size=None,
    ) as connection:
        yield Browser(connection)
