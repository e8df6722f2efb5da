"""Contacts and constraint rows of the present step as arguments of compiled loops.

MuJoCo makes these arrays again in each step, within one block of memory that belongs to its data. Asking its
Python module for each of them takes longer than a step of a small robot, so loops read them in that block,
at places that MuJoCo's own addresses give, looked up in each step. Where the addresses are not found, or
are not within the block, the module's arrays are passed instead: to the same loops, as blocks that begin with
the array.
"""

from __future__ import annotations

import ctypes
import struct
from functools import cache
from typing import Any
from zlib import crc32

import numpy as np

from roboyard._mujoco import mujoco
from roboyard._records import NamedTuple
from roboyard.sim.mujoco_library import stored_numbers
from roboyard.sim.stepping import step_row_kernels as kernels
from roboyard.sim.stepping.impulses.records import Search
from roboyard.sim.stepping.step_row_kernels import Contacts, Rows

ROWS = (
    "efc_type", "efc_id", "efc_J", "efc_pos", "efc_frictionloss", "efc_R", "efc_D", "efc_vel", "efc_aref",
    "efc_force", "efc_J_rownnz", "efc_J_rowadr", "efc_J_colind",
)  # fmt: skip
"""Names in MjData of the arrays of `Rows`."""
ARENA = 1
"""Place of the block's address among the addresses."""
_CONTACT = {
    "geom": 2, "efc_address": 0, "dim": 0, "dist": 0, "pos": 3, "frame": 9, "friction": 5, "mu": 0,
    "exclude": 0,
}  # fmt: skip
"""Names in MuJoCo's contact of the fields of `Contacts`, to the length of those that are vectors."""
_COUNTS = ("ncon", "ne", "nf", "nl", "nefc", "nJ")
ALL = 4
"""Place of the number of all rows among the counts."""
_UNPACK = struct.Struct(f"{len(_COUNTS)}i").unpack
_MOST_WORDS = 400
"""Words after the energies in which addresses are looked for; MuJoCo 4.0 has 181."""
_COUNT_WORDS = 64
"""Words before the energies in which the numbers of rows are looked for."""
_PROBE = """<mujoco><option jacobian="sparse"/><worldbody><geom type="plane" size="1 1 1"/>
    <body pos="0 0 0.09"><freejoint/>
    <geom size="0.1"/><geom size="0.1" pos="0.3 0 0"/>
    <body><joint name="j" frictionloss="1" limited="true" range="1 2"/><geom size="0.01"/></body></body>
    <body name="held"><freejoint/><geom size="0.01" contype="0" conaffinity="0"/></body></worldbody>
    <equality><connect body1="held" anchor="0 0 0"/></equality>
    <tendon><fixed><joint joint="j" coef="1"/></fixed></tendon></mujoco>"""
"""Each array has a size and an address of its own; without the tendon, one of no size had another's."""


_NO_CONTACTS = Contacts(
    *(np.zeros((0, 2), np.int32), np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros(0)),
    *(np.zeros((0, 3)), np.zeros((0, 9)), np.zeros((0, 5)), np.zeros(0), np.zeros(0, np.int32)),
)


_NO_SEARCH = Search(
    *(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.int32), np.zeros(0, np.int64)),
    *(0, 0, 0, 0, 0),
)


class StepRows:
    """Finds the contacts and rows of each step of one MjData; `look` once they are made."""

    def __init__(self, data: Any, degrees: int, *, is_sparse: bool) -> None:
        """Find nothing yet.

        Args:
            data: MjData; its memory lives at least as long as this object.
            degrees: number of degrees of freedom.
            is_sparse: whether the Jacobian is.
        """
        self._data = data
        known = layout()
        self._block = None if known is None else _Block(data, degrees, known, int(is_sparse))
        self.is_direct = self._block is not None
        """Whether `rows` and `contacts` are MuJoCo's block, in which loops find the arrays themselves."""
        self.contacts = _NO_CONTACTS
        self.own_records: Any = None
        """Rows that are made instead of MuJoCo's, with the contacts; see `ContactRows`."""
        self._degrees, self._is_sparse = degrees, int(is_sparse)
        self.search = self._passed_arrays()
        """Where compiled loops look for contacts and rows, if `is_direct`."""
        self._rows: Rows | None = None
        self.counts: tuple[int, ...] = (0,) * len(_COUNTS)
        """Numbers of contacts, of rows (equalities, dry friction, limits, all), of the Jacobian's entries."""
        if self._block is not None:
            self._rows, self.contacts = self._block.rows, self._block.contacts
            self.search = self._block.search

    @property
    def words(self) -> np.ndarray:
        """(n,) MuJoCo's block as whole numbers of four bytes, contacts first, if `is_direct`."""
        assert self._block is not None
        return self._block.words

    def counts_now(self) -> tuple[int, ...]:
        """Return `counts` of what MuJoCo has made by now, for arrays that are in its block."""
        assert self._block is not None
        self.counts = _UNPACK(self._block.counts)
        return self.counts

    def leave_memory(self) -> None:
        """Pass the arrays of MuJoCo's module from now on, since its addresses are not as expected."""
        self._block, self.is_direct = None, False
        self.search = self._passed_arrays()
        self.look()

    def _passed_arrays(self) -> Search:
        """Return a search that finds nothing, for arrays that are passed themselves."""
        return _NO_SEARCH._replace(
            counts=np.zeros(len(_COUNTS), np.int32), degrees=self._degrees, is_sparse=self._is_sparse
        )

    def look(self) -> tuple[int, ...]:
        """Find the contacts and rows that MuJoCo has made; return `counts`."""
        block = self._block
        if block is not None:
            if kernels.find_rows(*block.search):
                counts = self.counts = _UNPACK(block.counts)
                return counts
            self.leave_memory()
            return self.counts
        data = self._data
        self._rows, self.counts = None, tuple(getattr(data, name) for name in _COUNTS)
        self.search.counts[:] = self.counts
        self.contacts = _NO_CONTACTS
        if self.counts[0]:
            contact = data.contact
            self.contacts = Contacts(*(getattr(contact, name) for name in _CONTACT))
        return self.counts

    @property
    def rows(self) -> Rows:
        """The constraint rows of the step."""
        rows = self._rows
        if rows is None:
            data = self._data
            rows = self._rows = Rows._make(
                (*(getattr(data, name) for name in ROWS), np.zeros(len(ROWS), np.int64))
            )
        return rows


class _Block:
    """MuJoCo's block of memory, which one MjData keeps for good, as arrays."""

    def __init__(self, data: Any, degrees: int, known: Layout, is_sparse: int) -> None:
        self._owner = data
        words = _words(data, int(known.places.max()) + 1)
        address, size = int(words[ARENA]), int(data.narena) // 8 * 8
        memory: Any = (ctypes.c_byte * size).from_address(address)
        numbers, integers = np.frombuffer(memory, np.float64), np.frombuffer(memory, np.int32)
        starts = np.zeros(len(ROWS), np.int64)
        self.rows = Rows._make((integers, integers, *[numbers] * 8, *[integers] * 3, starts))
        most = size // known.contact_size
        self.contacts = Contacts(
            *(
                np.ndarray(
                    (most, length) if length else (most,),
                    kind,
                    memory,
                    offset,
                    (known.contact_size, kind.itemsize) if length else (known.contact_size,),
                )
                for (kind, offset), length in zip(known.fields, _CONTACT.values(), strict=True)
            )
        )
        first = data.energy.ctypes.data + known.counts
        numbers_of_rows: Any = (ctypes.c_int32 * len(_COUNTS)).from_address(first)
        self.counts = memoryview(numbers_of_rows)
        counts = np.frombuffer(numbers_of_rows, np.int32)
        place = address, size, known.contact_size, degrees, is_sparse
        self.search = Search(words, known.places, counts, starts, *place)
        self.words = integers


class Layout(NamedTuple):
    """Where MjData has the addresses and numbers of contacts and rows."""

    places: np.ndarray
    """(14,) places of the arrays of `ROWS` and of the contacts, in words after the energies."""
    contact_size: int
    """Bytes from one contact to the next."""
    fields: list[tuple[np.dtype, int]]
    """Type and byte in the contact of each field of `Contacts`."""
    counts: int
    """Bytes from the energies to the numbers of contacts and rows."""


@cache
def layout() -> Layout | None:
    """Return where the arrays are in MjData; None where the installed MuJoCo has them elsewhere."""
    names = crc32(repr((ROWS, _CONTACT, _COUNTS, _PROBE)).encode())
    numbers = stored_numbers(f"rows-{names:08x}", lambda: _numbers_of(find_layout()))
    if len(numbers) != len(ROWS) + 3 + 2 * len(_CONTACT):
        return None
    places, (size, counts), fields = numbers[: len(ROWS) + 1], numbers[-2:], numbers[len(ROWS) + 1 : -2]
    kinds = [np.dtype(chr(code)) for code in fields[::2]]
    return Layout(np.array(places, np.int64), size, list(zip(kinds, fields[1::2], strict=True)), counts)


def _numbers_of(found: Layout | None) -> list[int]:
    """Return a layout as whole numbers; none without one."""
    if found is None:
        return []
    fields = [number for kind, first in found.fields for number in (ord(kind.char), first)]
    return [*found.places.tolist(), *fields, found.contact_size, found.counts]


def find_layout() -> Layout | None:
    """Return where the arrays are in MjData, as found in one with arrays of known addresses.

    Returns:
        None where the installed version of MuJoCo has them elsewhere.
    """
    model = mujoco.MjModel.from_xml_string(_PROBE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    energies, signature, count = data.energy.ctypes.data, data.signature, 0
    last = energies + data.energy.nbytes
    while ctypes.c_uint64.from_address(last + 8 * count).value != signature:  # the last word
        count += 1
        if count > _MOST_WORDS:
            return None
    if energies - 8 * _COUNT_WORDS < getattr(data, "_address", energies):
        return None
    words, contact = _words(data, count).tolist(), data.contact
    start, size = contact.dist.ctypes.data, contact.dist.strides[0]
    addresses = [getattr(data, name).ctypes.data for name in ROWS]
    numbers = [getattr(data, name) for name in _COUNTS]
    before = list((ctypes.c_int32 * (2 * _COUNT_WORDS)).from_address(energies - 8 * _COUNT_WORDS))
    found = [k for k in range(len(before)) if before[k : k + len(numbers)] == numbers]
    if len(found) != 1 or 0 in numbers or words[ARENA : ARENA + 2] != [start, data.qpos.ctypes.data]:
        return None
    words[ARENA] = 0  # the contacts have the same one
    addresses.append(start)
    if size % 8 or any(words.count(address) != 1 for address in addresses):
        return None
    fields = [getattr(contact, name) for name in _CONTACT]
    return Layout(
        np.array([words.index(address) for address in addresses], np.int64),
        size,
        [(field.dtype, field.ctypes.data - start) for field in fields],
        4 * found[0] - 8 * _COUNT_WORDS,
    )


def _words(data: Any, count: int) -> np.ndarray:
    """Return a view (count,) of MjData from the address of its buffer on, which follows the energies."""
    start = data.energy.ctypes.data + data.energy.nbytes
    memory: Any = (ctypes.c_int64 * count).from_address(start)
    return np.frombuffer(memory, np.int64)
