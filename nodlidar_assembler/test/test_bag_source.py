"""Messages of bags, whole ones and such that were cut or damaged, against what was written."""

from bags import entries_of, recording, write_messages
from nodlidar_assembler.bags.bag_source import BagSource, messages_of
from nodlidar_assembler.bags.bag_topics import BagError
from nodlidar_common.bag_messages import SCAN
from nodlidar_sim.bag import TOPICS
import numpy as np
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin

STORAGES = [StoragePlugin.MCAP, StoragePlugin.SQLITE3]
ZSTD = CompressionMode.STORAGE, CompressionFormat.ZSTD
DURATION = 60.0  # several chunks of an MCAP file


@pytest.fixture(scope='module')
def entries():
    return entries_of(recording(DURATION))


@pytest.fixture(scope='module')
def mcap(entries, tmp_path_factory):
    return write_messages(tmp_path_factory.mktemp('whole') / 'bag', entries)


def read(path, wanted=TOPICS):
    """Return the messages of a bag, (time, topic), and the source."""
    with BagSource(path) as source:
        found = [(each.time_ns, each.topic) for each in source.messages(wanted)]
        return found, source


def span_of(path):
    with BagSource(path) as source:
        return source.span_ns


def written(entries):
    return [(time_ns, topic) for time_ns, topic, _ in entries]


def cut(path, to, share):
    """Copy a share of a bag's file, without metadata; return where it is."""
    [file] = path.glob('*.mcap')
    to.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    return to


@pytest.mark.parametrize('storage', STORAGES)
def test_all_messages_come_in_the_order_of_their_times(entries, tmp_path, storage):
    path = write_messages(tmp_path / 'bag', entries, storage)
    found, source = read(path)
    assert sorted(found) == sorted(written(entries))
    assert [time_ns for time_ns, _ in found] == sorted(time_ns for time_ns, _, _ in entries)
    assert not source.notes


def test_a_single_file_is_a_bag(entries, mcap):
    [file] = mcap.glob('*.mcap')
    assert len(read(file)[0]) == len(entries)


def test_only_wanted_topics_come_and_only_of_their_types(entries, mcap):
    scans = [time_ns for time_ns, topic, _ in entries if topic == '/scan']
    assert [time_ns for time_ns, _ in read(mcap, {'/scan': SCAN})[0]] == scans
    assert read(mcap, {'/joint_states': SCAN})[0] == []


def test_messages_are_what_was_written(entries, mcap):
    with BagSource(mcap) as source:
        first = next(source.messages({'/scan': SCAN}))
    expected = next(message for _, topic, message in entries if topic == '/scan')
    np.testing.assert_array_equal(first.message.ranges, expected.ranges)
    assert first.message.header == expected.header


def test_types_and_times_are_told(entries, mcap):
    with BagSource(mcap) as source:
        assert source.types == TOPICS
        first_ns, end_ns = source.span_ns
    assert (first_ns, end_ns - 1) == (entries[0][0], entries[-1][0])


@pytest.mark.parametrize('share', [0.5, 0.75, 0.99, 0.9999])
def test_of_an_mcap_file_that_ends_early_the_whole_chunks_are_read(entries, mcap, tmp_path, share):
    found, source = read(cut(mcap, tmp_path / 'cut.mcap', share))
    whole = written(entries)
    assert (share - 0.45) * len(whole) < len(found) <= len(whole)
    assert found == whole[: len(found)]
    assert any('ends early' in note for note in source.notes)


@pytest.mark.parametrize('share', [0.9, 0.95, 0.99])
def test_of_an_sqlite_file_that_ends_early_the_messages_before_are_read(entries, tmp_path, share):
    path = write_messages(tmp_path / 'bag', entries, StoragePlugin.SQLITE3)
    [file] = path.glob('*.db3')
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    found, source = read(path)
    whole = written(entries)
    assert (share - 0.2) * len(whole) < len(found) <= len(whole)
    assert found == whole[: len(found)]
    assert any('ends early' in note for note in source.notes)
    assert span_of(path) == (whole[0][0], whole[len(found) - 1][0] + 1)


@pytest.mark.parametrize('share', [0.5, 0.6, 0.7, 0.8])
def test_of_an_sqlite_file_that_ends_in_its_messages_those_that_are_left_are_read(tmp_path, share):
    entries = entries_of(recording(3.0))
    path = write_messages(tmp_path / 'bag', entries, StoragePlugin.SQLITE3)
    [file] = path.glob('*.db3')
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    found, _ = read(path)
    assert set(found) <= set(written(entries))
    assert len(found) > (share - 0.3) * len(entries)


def test_an_sqlite_file_without_the_way_to_its_messages_is_refused(entries, tmp_path):
    path = write_messages(tmp_path / 'bag', entries, StoragePlugin.SQLITE3)
    [file] = path.glob('*.db3')
    file.write_bytes(file.read_bytes()[:100_000])
    with pytest.raises(BagError, match='the pages that lead to its messages are missing'):
        read(path)


def test_a_folder_whose_recorder_was_killed_is_read_from_its_files(entries, mcap, tmp_path):
    folder = tmp_path / 'killed'
    folder.mkdir()
    cut(mcap, folder / 'killed_0.mcap', 0.8)
    found, source = read(folder)
    assert found == written(entries)[: len(found)]
    assert found
    assert 'there is no metadata.yaml: the recording was not finished' in source.notes


def test_the_files_of_a_split_bag_come_in_the_order_of_their_numbers(entries, tmp_path):
    folder = tmp_path / 'split'
    folder.mkdir()
    parts = np.array_split(np.arange(len(entries)), 11)
    for k, part in enumerate(parts):
        one = write_messages(tmp_path / f'part_{k}', [entries[i] for i in part])
        (one / f'part_{k}.mcap').rename(folder / f'split_{k}.mcap')
    assert sorted(read(folder)[0]) == sorted(written(entries))
    assert [time_ns for time_ns, _ in read(folder)[0]] == [time_ns for time_ns, _, _ in entries]


def test_from_a_damaged_chunk_on_nothing_is_read_and_it_is_said(entries, tmp_path):
    path = write_messages(tmp_path / 'bag', entries, compression=ZSTD)
    [file] = path.glob('*.mcap')
    data = bytearray(file.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 64] = bytes(64)
    file.write_bytes(data)
    found, source = read(path)
    assert 0 < len(found) < len(entries)
    assert found == written(entries)[: len(found)]
    assert any('damaged' in note for note in source.notes)


def test_messages_that_are_gone_from_a_file_are_counted(entries, tmp_path):
    path = write_messages(tmp_path / 'bag', entries)
    [file] = path.glob('*.mcap')
    data = bytearray(file.read_bytes())
    middle = data.index(b'\x05', len(data) // 2)
    data[middle : middle + 4096] = bytes(4096)  # records of no kind: passed over by any reader
    file.write_bytes(data)
    found, source = read(path)
    gone = len(entries) - len(found) - source.unreadable.total()
    assert gone > 0
    assert source.notes == [f'the bag is damaged: {gone} messages are missing']


@pytest.mark.parametrize('storage', STORAGES)
def test_messages_that_are_compressed_each_need_the_metadata(entries, tmp_path, storage):
    each = CompressionMode.MESSAGE, CompressionFormat.ZSTD
    path = write_messages(tmp_path / 'bag', entries[:200], storage, each)
    assert len(read(path)[0]) == 200
    [file] = [file for file in path.iterdir() if file.suffix != '.yaml']
    found, source = read(file)
    assert not found
    assert source.unreadable.total() == 200
    assert source.notes == ['each message is compressed: pass the folder with metadata.yaml']


@pytest.mark.parametrize('storage', STORAGES)
def test_a_compressed_file_without_its_metadata_is_to_be_unpacked(entries, tmp_path, storage):
    whole = CompressionMode.FILE, CompressionFormat.ZSTD
    path = write_messages(tmp_path / 'bag', entries[:200], storage, whole)
    assert len(read(path)[0]) == 200
    (path / 'metadata.yaml').unlink()
    [file] = path.iterdir()
    for bag in (path, file):
        with pytest.raises(
            BagError, match=r"'bag\..*\.zstd' is compressed: unpack it with unzstd"
        ):
            read(bag)


def test_what_a_library_says_of_a_bag_becomes_one_line(entries, tmp_path):
    path = write_messages(tmp_path / 'bag', entries[:200])
    metadata = path / 'metadata.yaml'
    metadata.write_text(f'{metadata.read_text()}\n  cut: [')
    found, source = read(path)
    assert len(found) == 200
    [note] = source.notes
    assert 'metadata.yaml' in note
    assert '\n' not in note


def test_bytes_that_are_no_message_are_counted_and_passed_over(entries, tmp_path):
    broken = [(entries[0][0], '/scan', b'\x00\x01\x00\x00\xff')]
    found, source = read(write_messages(tmp_path / 'bag', [*broken, *entries[:50]]))
    assert len(found) == 50
    assert source.unreadable == {'/scan': 1}


def test_as_a_whole_a_bag_is_read_to_its_end_or_refused(entries, mcap, tmp_path):
    def scans(topic, kind):
        return kind == SCAN

    found = [(each.time_ns, each.topic) for each in messages_of(mcap, scans)]
    assert found == [entry for entry in written(entries) if entry[1] == '/scan']
    broken = [(entries[0][0], '/scan', b'\x00\x01\x00\x00\xff')]
    unread = write_messages(tmp_path / 'unread', [*broken, *entries[:50]])
    for path, why in ((cut(mcap, tmp_path / 'cut.mcap', 0.5), 'ends early'), (unread, '/scan')):
        with pytest.raises(BagError, match=why):
            list(messages_of(path, scans))


@pytest.mark.parametrize('content', [b'', b'none', b'\x89MCAP0\r\n', bytes(5000)])
@pytest.mark.parametrize('suffix', ['.mcap', '.db3', '.txt'])
def test_what_is_no_bag_is_refused(tmp_path, content, suffix):
    file = tmp_path / f'file{suffix}'
    file.write_bytes(content)
    with pytest.raises(BagError, match=r"nothing of '.*' can be read|is empty"):
        span_of(file)


def test_a_bag_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(BagError, match=r"there is no '.*nowhere'"):
        span_of(tmp_path / 'nowhere')


def test_a_bag_of_ros_1_is_refused_with_the_way_to_make_one_of_ros_2(tmp_path):
    (tmp_path / 'old.bag').write_bytes(b'#ROSBAG V2.0\n')
    with pytest.raises(BagError, match=r'of ROS 1: rosbags-convert --src .*old\.bag --dst '):
        BagSource(tmp_path / 'old.bag').__enter__()
