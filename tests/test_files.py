"""Files are whole or absent, and checksums tell parts apart."""

import hashlib
import stat

import pytest

from flexik.errors import DataError
from flexik.files import (
    atomic_path,
    checksum,
    file_checksum,
    read_json,
    write_json,
    write_text,
)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_written_with_its_folder(tmp_path):
    path = tmp_path / "a" / "b" / "table.csv"
    with atomic_path(path) as temporary:
        assert temporary.parent == path.parent
        assert temporary.suffix == ".csv"
        assert temporary.name.startswith(".")
        temporary.write_text("1\n")
        assert not path.exists()
    assert path.read_text() == "1\n"
    assert names(path.parent) == ["table.csv"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_an_error_keeps_the_old_file_and_leaves_nothing(tmp_path, error):
    path = tmp_path / "table.csv"
    path.write_text("old")
    with pytest.raises(error), atomic_path(path) as temporary:
        temporary.write_text("half")
        raise error
    assert path.read_text() == "old"
    assert names(tmp_path) == ["table.csv"]


def test_an_error_leaves_no_new_file(tmp_path):
    with pytest.raises(ValueError), atomic_path(tmp_path / "new.csv"):
        raise ValueError
    assert names(tmp_path) == []


def test_results_can_be_read_by_others(tmp_path):
    write_text(tmp_path / "a.md", "x")
    assert stat.S_IMODE((tmp_path / "a.md").stat().st_mode) == 0o644


def test_text_is_utf8_with_plain_line_ends(tmp_path):
    write_text(tmp_path / "a.md", "0.5 µm\n")
    assert (tmp_path / "a.md").read_bytes() == b"0.5 \xc2\xb5m\n"


def test_a_number_json_does_not_have_keeps_the_old_file(tmp_path):
    path = tmp_path / "a.json"
    write_json(path, {"b": 1, "a": [0.1]})
    assert read_json(path) == {"b": 1, "a": [0.1]}
    assert list(read_json(path)) == ["b", "a"]
    with pytest.raises(ValueError):
        write_json(path, {"b": float("nan")})
    assert read_json(path) == {"b": 1, "a": [0.1]}
    assert names(tmp_path) == ["a.json"]


@pytest.mark.parametrize("content", [None, b"{", b"\xff\xfe", b""])
def test_json_that_cannot_be_read_is_named(tmp_path, content):
    path = tmp_path / "a.json"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(DataError, match=r"a\.json: "):
        read_json(path)


def test_checksum_tells_where_parts_end():
    assert checksum("ab", "c") != checksum("a", "bc")
    assert checksum("abc") != checksum("abc", "")
    assert checksum("a", "b") != checksum("b", "a")
    assert checksum() != checksum("")
    assert checksum("µ") == checksum("µ".encode())
    length = (3).to_bytes(8, "little")
    assert checksum("abc") == hashlib.sha256(length + b"abc").hexdigest()


def test_checksum_of_a_file_is_that_of_its_bytes(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"1\r\n")
    assert file_checksum(path) == checksum(b"1\r\n")
    with pytest.raises(DataError, match=r"b\.csv: cannot be read"):
        file_checksum(tmp_path / "b.csv")
