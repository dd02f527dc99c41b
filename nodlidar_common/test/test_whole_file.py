"""Files appear whole or not at all."""

import errno
import os

from nodlidar_common.whole_file import check_writable, whole_file, whole_files
import pytest


def write_half(path, error):
    with whole_file(path) as part:
        part.write_text('half')
        if error:
            raise error


def test_a_file_appears_when_it_is_whole(tmp_path):
    path = tmp_path / 'a.ply'
    path.write_text('old')
    with whole_file(path) as part:
        part.write_text('new')
        assert part.suffix == '.ply'
        assert path.read_text() == 'old'
    assert path.read_text() == 'new'
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize('error', [ValueError, KeyboardInterrupt])
def test_after_an_error_the_file_from_before_is_left(tmp_path, error):
    path = tmp_path / 'a.ply'
    path.write_text('old')
    with pytest.raises(error):
        write_half(path, error)
    assert path.read_text() == 'old'
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_told_with_the_name_that_the_user_gave(tmp_path):
    path = tmp_path / 'a.ply'
    with pytest.raises(OSError, match='No space left on device') as caught:
        write_half(path, OSError(errno.ENOSPC, 'No space left on device'))
    assert caught.value.filename == str(path)
    with pytest.raises(FileNotFoundError) as caught:
        write_half(path / 'b', None)
    assert caught.value.filename == str(path / 'b')


def test_a_folder_is_not_replaced(tmp_path):
    with pytest.raises(IsADirectoryError) as caught:
        write_half(tmp_path, None)
    assert caught.value.filename == str(tmp_path)


def test_a_path_that_cannot_be_written_is_known_before(tmp_path):
    path = tmp_path / 'a.ply'
    check_writable(path)
    assert list(tmp_path.iterdir()) == []
    for wrong, error in (
        (tmp_path / 'no' / 'b', FileNotFoundError),
        (tmp_path, IsADirectoryError),
    ):
        with pytest.raises(error) as caught:
            check_writable(wrong)
        assert caught.value.filename == str(wrong)


def test_of_a_link_its_file_is_replaced(tmp_path):
    path, link = tmp_path / 'a.ply', tmp_path / 'link'
    path.write_text('old')
    link.symlink_to(path)
    with whole_file(link) as part:
        part.write_text('new')
    assert link.is_symlink()
    assert path.read_text() == 'new'


@pytest.mark.parametrize('attempt', [check_writable, lambda path: write_half(path, None)])
def test_a_device_is_not_replaced(tmp_path, attempt):
    """Such as /dev/null, which anybody may replace who is root."""
    path = tmp_path / 'pipe'
    os.mkfifo(path)
    with pytest.raises(OSError, match='no regular file') as caught:
        attempt(path)
    assert caught.value.filename == str(path)
    assert path.is_fifo()


def write_files(folder, names, error=None):
    with whole_files(folder) as part:
        for name in names:
            (part / name).write_text('new')
        if error:
            raise error


def test_files_replace_those_of_before_together(tmp_path):
    (tmp_path / 'a').write_text('old')
    write_files(tmp_path, 'ab')
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {'a': 'new', 'b': 'new'}


@pytest.mark.parametrize('wrong', ['a', 'b', 'c'])
def test_if_one_file_cannot_be_replaced_none_is(tmp_path, wrong):
    for name in 'abc':
        if name == wrong:
            (tmp_path / name).mkdir()
        else:
            (tmp_path / name).write_text('old')
    with pytest.raises(IsADirectoryError) as caught:
        write_files(tmp_path, 'abc')
    assert caught.value.filename == str(tmp_path / wrong)
    assert {path.read_text() for path in tmp_path.iterdir() if path.is_file()} == {'old'}
    assert len(list(tmp_path.iterdir())) == 3


def test_a_folder_of_no_files_is_not_left(tmp_path):
    with pytest.raises(OSError, match='No space left'):
        write_files(tmp_path / 'new', 'a', OSError(errno.ENOSPC, 'No space left on device'))
    assert list(tmp_path.iterdir()) == []
