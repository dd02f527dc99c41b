"""Bags with any damage: what can be read is, and all else is one typed error."""

from contextlib import suppress
import shutil

from bags import entries_of, recording, write_messages
from hypothesis import given, HealthCheck, settings
from hypothesis import strategies as st
from nodlidar_assembler.bags.bag_source import BagSource
from nodlidar_assembler.bags.bag_topics import BagError
from nodlidar_assembler.commands.entry_points import assemble_bag
from nodlidar_sim.bag import TOPICS
import pytest
from rosbags.rosbag2 import StoragePlugin
import yaml


@pytest.fixture(scope='module')
def entries():
    return entries_of(recording(1.0))


@pytest.fixture(scope='module')
def whole(entries, tmp_path_factory):
    return write_messages(tmp_path_factory.mktemp('whole') / 'bag', entries)


@pytest.fixture(scope='module')
def whole_sqlite(entries, tmp_path_factory):
    folder = tmp_path_factory.mktemp('sqlite')
    return write_messages(folder / 'bag', entries[:100], StoragePlugin.SQLITE3)


def read(path):
    """Return how many messages of a bag can be read, and its notes."""
    with BagSource(path) as source:
        first_ns, end_ns = source.span_ns
        assert all(topic in source.types for topic in source.unreadable)
        count = sum(first_ns <= each.time_ns < end_ns for each in source.messages(TOPICS))
        return count, source.notes


@pytest.mark.parametrize(
    ('keys', 'value'),
    [
        (['starting_time', 'nanoseconds_since_epoch'], 'noon'),
        (['starting_time', 'nanoseconds_since_epoch'], -1),
        (['starting_time', 'nanoseconds_since_epoch'], 10**30),
        (['starting_time', 'nanoseconds_since_epoch'], 1.5),
        (['duration', 'nanoseconds'], None),
        (['duration', 'nanoseconds'], [1]),
        (['duration', 'nanoseconds'], -(10**9)),
        (['message_count'], None),
        (['message_count'], 'many'),
        (['message_count'], -1),
        (['topics_with_message_count', 0, 'message_count'], 'many'),
        (['topics_with_message_count', 0, 'topic_metadata', 'name'], 7),
        (['topics_with_message_count', 0, 'topic_metadata', 'type'], None),
        (['topics_with_message_count'], 3),
        (['relative_file_paths'], [None]),
        (['compression_mode'], 3),
        (['storage_identifier'], ['mcap']),
        (['files'], 3),
        (['version'], 'nine'),
        ([], None),
    ],
)
def test_metadata_with_a_wrong_value_does_not_keep_the_messages_back(
    entries, whole, tmp_path, capsys, keys, value
):
    bag = tmp_path / 'bag'
    shutil.copytree(whole, bag)
    metadata = yaml.safe_load((bag / 'metadata.yaml').read_text())
    at, place = metadata, 'rosbag2_bagfile_information'
    for key in keys:
        at, place = at[place], key
    at[place] = value
    (bag / 'metadata.yaml').write_text(yaml.safe_dump(metadata))
    count, notes = read(bag)
    assert count == len(entries)
    assert len(notes) == 1
    assert assemble_bag([str(bag), str(tmp_path / 'out.ply')]) == 0
    assert capsys.readouterr().err == ''


def test_a_bag_of_one_message_is_shown_without_a_division(entries, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv('FORCE_COLOR', '1')
    scan = next(entry for entry in entries if entry[1] == '/scan')
    joint = next(entry for entry in entries if entry[1] == '/joint_states')
    bag = write_messages(tmp_path / 'bag', [(scan[0], *joint[1:]), scan])
    assert assemble_bag([str(bag), str(tmp_path / 'out.ply')]) == 1
    assert 'no cloud from 1 scans' in capsys.readouterr().err


CHANGE = st.tuples(st.floats(0.0, 1.0, exclude_max=True), st.binary(max_size=8), st.integers(0, 9))


@settings(max_examples=40, suppress_health_check=list(HealthCheck))
@given(st.booleans(), st.booleans(), st.lists(CHANGE, min_size=1, max_size=4))
def test_any_bytes_in_the_place_of_others_are_read_over_or_a_typed_error(
    whole, whole_sqlite, tmp_path_factory, sqlite, of_metadata, changes
):
    original = whole_sqlite if sqlite else whole
    bag = tmp_path_factory.mktemp('changed') / 'bag'
    shutil.copytree(original, bag)
    [data] = [file for file in bag.iterdir() if file.suffix != '.yaml']
    file = bag / 'metadata.yaml' if of_metadata else data
    content = bytearray(file.read_bytes())
    for where, new, old in changes:
        begin = int(where * len(content))
        content[begin : begin + old] = new
    file.write_bytes(content)
    with suppress(BagError):
        read(bag)
