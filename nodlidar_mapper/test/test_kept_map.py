"""When and where the maps of a node are saved."""

import errno
from pathlib import Path
import threading
from types import SimpleNamespace

from nodlidar_mapper.ros import kept_map
from nodlidar_mapper.ros.kept_map import KeptMap, MOST_WAITING
import pytest

DEADLINE = 10.0


class Log:
    """Keeps what is logged."""

    def __init__(self):
        self.info, self.warning, self.error = [].append, self._warn, [].append
        self.warnings = []

    def _warn(self, text):
        self.warnings.append(text)


class Disk:
    """Takes the files of maps; each kind can be held up."""

    def __init__(self, monkeypatch):
        self.written, self.writing = [], []
        self.gates = {kind: threading.Event() for kind in ('keyframes', 'others')}
        for gate in self.gates.values():
            gate.set()
        monkeypatch.setattr(kept_map, 'save_keyframes_of', self._taker('keyframes'))
        monkeypatch.setattr(kept_map, 'save', self._taker('others'))

    @property
    def kinds_and_keyframes(self):
        return [(kind, keyframes) for kind, _, keyframes in self.written]

    def _taker(self, kind):
        def take(folder, snapshot, *_, **__):
            self.writing.append((kind, folder))
            assert self.gates[kind].wait(DEADLINE)
            self.writing.remove((kind, folder))
            self.written.append((kind, Path(folder).name, snapshot.keyframes))

        return take


@pytest.fixture
def disk(monkeypatch):
    monkeypatch.setattr(kept_map, 'PERIOD', 0.0)
    return Disk(monkeypatch)


@pytest.fixture
def kept(tmp_path, disk):
    log = Log()
    kept = KeptMap(SimpleNamespace(save_folder=str(tmp_path)), log)
    kept.warnings = log.warnings
    return kept


def snapshot(*keyframes):
    return SimpleNamespace(keyframes=keyframes)


def step_until(kept, condition, now=None):
    turn = threading.Event()
    for _ in range(round(DEADLINE / 0.01)):
        kept.step(now)
        if condition():
            return
        turn.wait(0.01)
    raise AssertionError('not in time')


def test_a_map_that_ends_while_its_keyframes_are_saved_is_saved_after_that(kept, disk):
    disk.gates['keyframes'].clear()
    step_until(kept, lambda: disk.writing, snapshot('a'))
    kept.begin(snapshot('a', 'b'))
    for _ in range(20):
        kept.step(None)
    assert [kind for kind, _ in disk.writing].count('keyframes') == 1
    disk.gates['keyframes'].set()
    step_until(kept, lambda: len(disk.written) == 3)
    kept.end(None)
    [(_, folder, _), *_] = disk.written
    assert sorted(disk.written) == [
        ('keyframes', folder, ('a',)),
        ('keyframes', folder, ('a', 'b')),
        ('others', folder, ('a', 'b')),
    ]


def test_a_map_that_cannot_be_saved_is_told_until_it_can(kept, disk, monkeypatch):
    def fail(*_):
        raise OSError(errno.ENOSPC, 'No space left on device')

    save = kept_map.save_keyframes_of
    monkeypatch.setattr(kept_map, 'save_keyframes_of', fail)
    step_until(kept, lambda: kept.unsaved, snapshot('a'))
    assert kept.unsaved == 'the map was not saved: No space left on device'
    monkeypatch.setattr(kept_map, 'save_keyframes_of', save)
    step_until(kept, lambda: not kept.unsaved, snapshot('a'))
    assert disk.kinds_and_keyframes == [('keyframes', ('a',))]


def test_at_the_end_all_keyframes_come_first_each_map_in_its_folder(kept, disk):
    kept.begin(snapshot('a'))
    kept.begin(snapshot('b'))
    kept.end(snapshot('c'))
    kinds, folders, keyframes = zip(*disk.written, strict=True)
    assert kinds == ('keyframes',) * 3 + ('others',) * 3
    assert keyframes == (('a',), ('b',), ('c',)) * 2
    assert folders[:3] == folders[3:]
    assert len(set(folders)) == 3


def test_while_the_other_files_of_a_map_are_saved_so_are_keyframes_of_the_next(kept, disk):
    disk.gates['others'].clear()
    kept.begin(snapshot('a'))
    step_until(kept, lambda: 'others' in dict(disk.writing))
    step_until(kept, lambda: disk.written[-1][2] == ('b',), snapshot('b'))
    disk.gates['others'].set()
    kept.end(None)


def test_maps_that_end_faster_than_they_can_be_saved_are_named(kept, disk):
    disk.gates['others'].clear()
    for number in range(MOST_WAITING + 3):
        kept.begin(snapshot(number))
        step_until(kept, lambda last=(number,): ('keyframes', last) in disk.kinds_and_keyframes)
    assert len(kept.warnings) == 2  # one is being saved
    assert 'has only keyframes' in kept.warnings[0]
    disk.gates['others'].set()
    kept.end(None)
    others = [keyframes for kind, keyframes in disk.kinds_and_keyframes if kind == 'others']
    assert others == [(0,), (3,), (4,)]


def fail_once(monkeypatch, kind):
    """Let the next saving of a kind of files fail."""
    save = getattr(kept_map, kind)

    def fail(*_, **__):
        monkeypatch.setattr(kept_map, kind, save)
        raise OSError(errno.ENOSPC, 'No space left on device')

    monkeypatch.setattr(kept_map, kind, fail)


def test_a_map_that_ended_and_could_not_be_saved_is_tried_again(kept, disk, monkeypatch):
    fail_once(monkeypatch, 'save_keyframes_of')
    kept.begin(snapshot('a'))
    step_until(kept, lambda: len(disk.written) == 2)
    kept.end(None)
    assert disk.kinds_and_keyframes == [('keyframes', ('a',)), ('others', ('a',))]
    assert not kept.unsaved


def test_a_map_that_is_being_saved_as_the_node_ends_is_saved_wholly(kept, disk, monkeypatch):
    disk.gates['keyframes'].clear()
    kept.begin(snapshot('a'))
    step_until(kept, lambda: disk.writing)
    threading.Timer(0.1, disk.gates['keyframes'].set).start()
    kept.end(None)
    assert disk.kinds_and_keyframes == [('keyframes', ('a',)), ('others', ('a',))]


@pytest.mark.parametrize('kind', ['save_keyframes_of', 'save'])
def test_it_is_told_until_that_map_is_saved_whatever_becomes_of_the_next(
    kept, disk, monkeypatch, kind
):
    fail_once(monkeypatch, kind)
    monkeypatch.setattr(kept_map, 'PERIOD', 1e3)  # a is not tried again soon
    kept.begin(snapshot('a'))
    step_until(kept, lambda: kept.unsaved)
    monkeypatch.setattr(kept_map, 'PERIOD', 0.0)
    kept.begin()
    step_until(kept, lambda: ('keyframes', ('b',)) in disk.kinds_and_keyframes, snapshot('b'))
    assert 'No space left' in kept.unsaved
    kept.end(snapshot('b'))
    assert bool(kept.unsaved) is (kind == 'save')  # the keyframes are saved at the end
