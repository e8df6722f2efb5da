"""Read NumPy archives (.npz) from any source: no more memory than they may hold."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.untrusted.files import read_file

if TYPE_CHECKING:
    import zipfile


class ArraysError(Exception):
    """An archive is damaged or would unpack to too much."""


def read_arrays(file: Path | str, max_bytes: int) -> dict[str, np.ndarray]:
    """Return the arrays (...,) of an archive by name.

    Args:
        file: its path.
        max_bytes: largest sum of the unpacked arrays, and largest file (bytes).

    Raises:
        ArraysError: it is no such archive, is cut off, holds Python objects or unpacks to more.
        OSError: it does not exist, cannot be read, is no regular file or is too large.
    """
    return unpack_arrays(read_file(file, max_bytes), max_bytes)


def unpack_arrays(data: bytes, max_bytes: int) -> dict[str, np.ndarray]:
    """Return the arrays (...,) of an archive in memory, as `read_arrays`.

    Raises:
        ArraysError: as for `read_arrays`.
    """
    import zipfile

    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            total = sum(member.file_size for member in members)
            if total > max_bytes:
                raise ArraysError(f"it unpacks to {total / 2**20:.0f} MiB (at most {max_bytes / 2**20:.0f})")
            return {m.filename.removesuffix(".npy"): _array(archive, m) for m in members}
    except ArraysError:
        raise
    except Exception as error:  # zipfile, zlib and NumPy raise many types for damaged archives
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise ArraysError(f"it is damaged ({reason})") from None


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    """One array; what its header announces is compared with what the archive holds before memory is taken."""
    with archive.open(member) as packed:
        content = packed.read(member.file_size)
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    readers: dict[Any, Any] = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in readers:
        raise ArraysError(f"{member.filename}: unknown version {version} of the format")
    shape, _, kind = readers[version](stream)
    if kind.hasobject:
        raise ArraysError(f"{member.filename}: it holds Python objects, which are not read")
    needed = math.prod(shape) * kind.itemsize
    if needed > len(content) - stream.tell() or (not kind.itemsize and math.prod(shape) > 1):
        raise ArraysError(f"{member.filename}: {len(content)} bytes are too few for shape {shape}")
    stream.seek(0)
    return np.lib.format.read_array(stream, allow_pickle=False)
