"""One direction of a bad connection, which changes, swaps, loses, inserts or delays bytes."""

from collections import deque

import numpy as np


class FaultyLine:
    """Carries bytes in one direction.

    Parameters
    ----------
    seed
        Of the choice of bytes.

    Attributes
    ----------
    corrupt_rate
        Share of the bytes that have one bit flipped.
    swap_rate
        Share of the bytes that change places with the next one, which a sum does not show.
    drop_rate
        Share of the bytes that are lost.
    insert_rate
        Share of the bytes before which a random byte is inserted.
    mute
        Whether all bytes are lost.
    delay_ns, jitter_ns
        Constant delay, and the greatest random delay added to it [ns].
    first_hit_ns
        When a fault first affected bytes [ns]; None if none has.
    """

    def __init__(self, seed: int | list[int] = 0) -> None:
        self._rng = np.random.default_rng(seed)
        self._late: deque[tuple[int, bytes]] = deque()
        self.mend()

    def mend(self) -> None:
        """Remove all faults; delayed bytes keep their delay."""
        self.corrupt_rate = self.swap_rate = self.drop_rate = self.insert_rate = 0.0
        self.mute = False
        self.delay_ns = self.jitter_ns = 0
        self.first_hit_ns: int | None = None

    def carry(self, data: bytes, now_ns: int) -> bytes:
        """Accept bytes at a time [ns], and remove and return those due by then."""
        if data:
            damaged = self._damaged(data)
            due_ns = now_ns + self._delay_ns()
            if self.first_hit_ns is None and (damaged != data or due_ns > now_ns):
                self.first_hit_ns = now_ns
            self._late.append((max(due_ns, self._late[-1][0] if self._late else 0), damaged))
        due = b''
        while self._late and self._late[0][0] <= now_ns:
            due += self._late.popleft()[1]
        return due

    def next_event_ns(self) -> int | None:
        """Return when the next delayed bytes are due [ns], None if none are delayed."""
        return self._late[0][0] if self._late else None

    def _delay_ns(self) -> int:
        more_ns = round(self._rng.uniform(0.0, self.jitter_ns)) if self.jitter_ns else 0
        return self.delay_ns + more_ns

    def _damaged(self, data: bytes) -> bytes:
        if self.mute:
            return b''
        if self.corrupt_rate > 0.0:
            data = self._corrupt(data)
        if self.swap_rate > 0.0:
            data = self._swap(data)
        if self.drop_rate > 0.0:
            data = self._drop(data)
        if self.insert_rate > 0.0:
            data = self._insert(data)
        return data

    def _corrupt(self, data: bytes) -> bytes:
        sound = np.frombuffer(data, np.uint8)
        bits = np.left_shift(1, self._rng.integers(0, 8, sound.size)).astype(np.uint8)
        hit = self._rng.random(sound.size) < self.corrupt_rate
        return np.where(hit, sound ^ bits, sound).astype(np.uint8).tobytes()

    def _swap(self, data: bytes) -> bytes:
        swapped = bytearray(data)
        for first in np.flatnonzero(self._rng.random(max(len(data) - 1, 0)) < self.swap_rate):
            swapped[first], swapped[first + 1] = swapped[first + 1], swapped[first]
        return bytes(swapped)

    def _drop(self, data: bytes) -> bytes:
        sound = np.frombuffer(data, np.uint8)
        return sound[self._rng.random(sound.size) >= self.drop_rate].tobytes()

    def _insert(self, data: bytes) -> bytes:
        sound = np.frombuffer(data, np.uint8)
        places = np.flatnonzero(self._rng.random(sound.size) < self.insert_rate)
        values = self._rng.integers(0, 256, places.size).astype(np.uint8)
        return np.insert(sound, places, values).tobytes()
