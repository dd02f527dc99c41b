"""Files appear whole or not at all."""

import errno

from nodlidar_common.whole_file import check_writable, whole_file
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
