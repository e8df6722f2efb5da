"""Reading regular files within bounds, archives within memory, and text for a terminal."""

from __future__ import annotations

import io
import os
import socket
import zipfile
from pathlib import Path

import numpy as np
import pytest

from roboyard.untrusted.arrays import ArraysError, read_arrays, unpack_arrays
from roboyard.untrusted.files import FileRefusedError, check_file, is_inside, read_file, read_head
from roboyard.untrusted.text import one_line, printable


def test_a_file_of_the_allowed_size_is_read_and_a_larger_one_is_not(tmp_path: Path) -> None:
    file = tmp_path / "a"
    file.write_bytes(b"x" * 100)
    assert read_file(file, 100) == b"x" * 100
    assert check_file(file, 100) == 100
    for refused in (read_file, check_file):
        with pytest.raises(FileRefusedError) as error:
            refused(file, 99)
        assert error.value.strerror == "100 bytes is too large (at most 99 bytes)"
    assert (read_head(file, 7), read_head(file, 1000)) == (b"x" * 7, b"x" * 100)


def test_pipes_sockets_and_devices_are_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to(tmp_path / "pipe")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "s"))
        for file in (tmp_path / "pipe", tmp_path / "link", tmp_path / "s", Path("/dev/zero")):
            for refused in (read_file, read_head, check_file):
                with pytest.raises(OSError):
                    refused(file, 1000)


def test_folders_and_missing_files_keep_their_own_errors(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        read_file(tmp_path, 10)
    with pytest.raises(FileNotFoundError):
        read_file(tmp_path / "none", 10)


def test_inside_is_judged_after_links(tmp_path: Path) -> None:
    inside, outside = tmp_path / "in", tmp_path / "out"
    inside.mkdir(), outside.mkdir()
    (outside / "f").touch()
    (inside / "link").symlink_to(outside / "f")
    (inside / "ring").symlink_to(inside / "ring")
    (tmp_path / "short").symlink_to(inside)
    (inside / "g").touch()
    assert is_inside(inside / "g", [tmp_path / "short"])
    assert is_inside(tmp_path / "short" / "g", [inside])
    assert not is_inside(inside / "link", [inside])
    assert not is_inside(inside / ".." / "out" / "f", [inside])
    assert not is_inside(inside / "ring" / "x", [outside])


def test_arrays_return_as_they_were_saved(tmp_path: Path) -> None:
    arrays = {
        "a": np.arange(12.0).reshape(3, 4),
        "names": np.array(["x", "yü"]),
        "empty": np.zeros((0, 3)),
        "scalar": np.array(5),
        "fortran": np.asfortranarray(np.arange(6).reshape(2, 3)),
    }
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "a.npz", **arrays)
        read = read_arrays(tmp_path / "a.npz", 1 << 20)
        assert read.keys() == arrays.keys()
        for name, value in arrays.items():
            np.testing.assert_array_equal(read[name], value)
            assert read[name].dtype == value.dtype


def archive(**members: bytes) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as made:
        for name, content in members.items():
            made.writestr(f"{name}.npy", content)
    return out.getvalue()


def npy(shape: tuple[int, ...], content: bytes, kind: str = "<f8") -> bytes:
    out = io.BytesIO()
    np.lib.format.write_array_header_1_0(out, {"descr": kind, "fortran_order": False, "shape": shape})
    return out.getvalue() + content


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "not a zip file"),
        (b"PK\x03\x04" + b"\0" * 100, "not a zip file"),
        (archive(bomb=npy((1 << 24,), b"\0" * (1 << 27))), "unpacks to"),
        (archive(liar=npy((1 << 50,), b"\0" * 8)), "too few"),
        (archive(liar=npy((1 << 62, 1 << 62), b"")), "too few"),
        (archive(liar=npy((1 << 40,), b"", "|V0")), "too few"),
        (archive(objects=npy((1,), b"\0" * 8, "|O")), "Python objects"),
        (archive(text=b"no array at all"), "damaged"),
        (archive(future=b"\x93NUMPY\x09\0" + b"\0" * 20), "unknown version"),
    ],
)  # fmt: skip
def test_damaged_archives_and_bombs_are_refused(data: bytes, reason: str) -> None:
    with pytest.raises(ArraysError, match=reason):
        unpack_arrays(data, 1 << 26)


def test_an_archive_cut_anywhere_is_refused() -> None:
    out = io.BytesIO()
    np.savez_compressed(out, a=np.random.default_rng(0).random(100))
    whole = out.getvalue()
    for length in range(0, len(whole), 7):
        with pytest.raises(ArraysError):
            unpack_arrays(whole[:length], 1 << 20)


def test_control_characters_are_shown() -> None:
    assert printable("a\x1b[2Jb\x07\n\tü\u202e") == "a\\x1b[2Jb\\x07\n\tü\\u202e"
    assert one_line("a\nb\tc") == "a\\nb\\tc"
    assert printable("\x9b31m\ud800") == "\\x9b31m\\ud800"
