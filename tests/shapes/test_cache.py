"""The cache keeps arrays, and takes damage for absence."""

import numpy as np
import pytest

from roboyard.shapes.cache import cache_folder, content_key, load_arrays, store_arrays


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOYARD_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_round_trip(folder):
    arrays = {"a": np.arange(6.0).reshape(2, 3), "text": np.array("metres")}
    assert cache_folder() == folder
    assert load_arrays("kind", "abcd") is None
    assert store_arrays("kind", "abcd", arrays)
    back = load_arrays("kind", "abcd")
    assert back is not None
    assert np.array_equal(back["a"], arrays["a"])
    assert str(back["text"]) == "metres"
    assert load_arrays("other", "abcd") is None
    assert [path.suffix for path in folder.rglob("*") if path.is_file()] == [".npz"]


@pytest.mark.parametrize("damage", ["empty", "cut", "garbage", "flipped"])
def test_damaged_entries_count_as_absent(folder, damage):
    store_arrays("kind", "abcd", {"a": np.arange(1000.0)})
    (entry,) = (path for path in folder.rglob("*.npz"))
    content = bytearray(entry.read_bytes())
    content[len(content) // 2] ^= 0xFF
    entry.write_bytes(
        {"empty": b"", "cut": content[:500], "garbage": b"not a zip file at all", "flipped": content}[damage]
    )
    assert load_arrays("kind", "abcd") is None
    assert store_arrays("kind", "abcd", {"a": np.arange(3.0)})
    assert load_arrays("kind", "abcd") is not None


def test_pickles_are_never_loaded(folder):
    entry = folder / "kind" / "ab" / "abcd.npz"
    entry.parent.mkdir(parents=True)
    np.savez(entry, a=np.array([{"x": 1}], dtype=object))
    assert load_arrays("kind", "abcd") is None


def test_unwritable_folder_is_no_error(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("ROBOYARD_CACHE", str(blocked))
    assert not store_arrays("kind", "abcd", {"a": np.zeros(1)})
    assert load_arrays("kind", "abcd") is None


def test_failed_write_leaves_nothing_behind(folder):
    with pytest.raises(ValueError, match="allow_pickle"):
        store_arrays("kind", "abcd", {"a": np.array([object()])})
    assert not [path for path in folder.rglob("*") if path.is_file()]


def test_key_depends_on_everything():
    a = np.arange(6.0)
    keys = [
        content_key(a, 8),
        content_key(a, 9),
        content_key(a.reshape(2, 3), 8),
        content_key(a.astype(np.float32), 8),
        content_key(a + 1e-12, 8),
        content_key(8, a),
    ]
    assert len(set(keys)) == len(keys)
    assert content_key(a.copy(), 8) == keys[0]


def test_default_folder_is_the_users(monkeypatch):
    monkeypatch.delenv("ROBOYARD_CACHE")
    assert cache_folder().name in {"roboyard", "Cache"}
