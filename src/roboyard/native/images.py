"""Object files of x86-64 Linux as images: code and constants in one piece, loaded without a linker.

LLVM, which loads object files, takes 0.03 s to load itself.
"""

from __future__ import annotations

from struct import calcsize, iter_unpack, pack_into, unpack_from

from roboyard._records import dataclass

_SECTION, _SYMBOL, _RELOCATION = "<IIQQQQIIQQ", "<IBBHQQ", "<QQq"
_IN_MEMORY, _WRITABLE = 0x2, 0x1
_SYMBOLS, _RELOCATIONS, _ZEROS = 2, 4, 8
_ABSOLUTE, _NEAR, _CALL, _FAR = 1, 2, 4, 24
_BY_TABLE = (9, 41, 42)
_FIRST_SPECIAL_SECTION = 0xFF00
_JUMP = b"\xff\x25"  # to the address that stands at a distance


@dataclass(frozen=True)
class Image:
    """A function's code and constants, and what depends on where they stand in memory."""

    code: bytes
    entry: int
    """Offset of the function."""
    own: tuple[tuple[int, int], ...]
    """Offset of eight bytes to the offset whose address they are."""
    others: tuple[tuple[int, str], ...]
    """Offset of eight bytes to the name of the function of the process whose address they are."""

    def to_bytes(self) -> bytes:
        """Return the image as the content of a file."""
        pairs = (" ".join(f"{place}:{target}" for place, target in part) for part in (self.own, self.others))
        head = "\n".join((str(self.entry), *pairs)).encode()
        return len(head).to_bytes(8, "little") + head + self.code


def image_from_bytes(data: bytes) -> Image:
    """Return the image that `Image.to_bytes` wrote."""
    size = 8 + int.from_bytes(data[:8], "little")
    entry, *parts = data[8:size].decode().split("\n")
    own, others = ([pair.split(":") for pair in part.split()] for part in parts)
    return Image(
        code=data[size:],
        entry=int(entry),
        own=tuple((int(place), int(target)) for place, target in own),
        others=tuple((int(place), name) for place, name in others),
    )


def image_of(file: bytes, name: str) -> Image | None:
    """Return the image of an object file; None where it has what an image cannot have, such as variables.

    Args:
        file: content of an ELF object file for x86-64.
        name: name of the function at which the image is entered.
    """
    try:
        return _Linking(file).image(name)
    except _Unknown:
        return None


class _Unknown(Exception):
    """Something that an image cannot have."""


class _Linking:
    """One object file on its way to an image."""

    def __init__(self, file: bytes) -> None:
        (start,) = unpack_from("<Q", file, 0x28)
        size, count, names = unpack_from("<HHH", file, 0x3A)
        self._file = file
        self._sections = [unpack_from(_SECTION, file, start + k * size) for k in range(count)]
        self._names = self._content(names)
        self._code = bytearray()
        self._places: dict[int, int] = {}
        self._slots: dict[tuple[str, int], int] = {}
        self._stubs: dict[str, int] = {}
        self._own: list[tuple[int, int]] = []
        self._others: list[tuple[int, str]] = []
        for k, section in enumerate(self._sections):
            if section[2] & _IN_MEMORY and section[5] and not self._name(section).startswith(".eh_frame"):
                self._place(k, section)

    def image(self, name: str) -> Image:
        symbols, names = self._symbols()
        entry = [self._offset(s) for s in symbols if _text(names, s[0]) == name and s[3]]
        if len(entry) != 1:
            raise _Unknown
        for section in self._sections:
            if section[1] == _RELOCATIONS and section[7] in self._places:
                for offset, kind, addend in iter_unpack(_RELOCATION, self._bytes(section)):
                    symbol = symbols[kind >> 32]
                    place = self._places[section[7]] + offset
                    self._relocate(place, kind & 0xFFFFFFFF, symbol, _text(names, symbol[0]), addend)
        return Image(bytes(self._code), entry[0], tuple(self._own), tuple(self._others))

    def _place(self, index: int, section: tuple[int, ...]) -> None:
        is_constant = self._name(section).startswith(".data.rel.ro")
        if section[1] == _ZEROS or (section[2] & _WRITABLE and not is_constant):
            raise _Unknown  # a variable
        self._align(max(section[8], 1))
        self._places[index] = len(self._code)
        self._code += self._bytes(section)

    def _relocate(self, place: int, kind: int, symbol: tuple[int, ...], name: str, addend: int) -> None:
        is_other = symbol[3] == 0
        if kind in _BY_TABLE:
            self._write("<i", place, self._slot(symbol, name) + addend - place)
        elif kind in (_NEAR, _CALL):
            target = self._stub(symbol, name) if is_other else self._offset(symbol)
            self._write("<i", place, target + addend - place)
        elif kind == _FAR and not is_other:
            self._write("<q", place, self._offset(symbol) + addend - place)
        elif kind == _ABSOLUTE and not is_other:
            self._own.append((place, self._offset(symbol) + addend))
        elif kind == _ABSOLUTE and not addend:
            self._others.append((place, name))
        else:
            raise _Unknown

    def _slot(self, symbol: tuple[int, ...], name: str) -> int:
        """Return the offset of eight bytes with a symbol's address."""
        key = (name, -1) if symbol[3] == 0 else ("", self._offset(symbol))
        if key not in self._slots:
            self._align(8)
            self._slots[key] = len(self._code)
            if symbol[3] == 0:
                self._others.append((len(self._code), name))
            else:
                self._own.append((len(self._code), key[1]))
            self._code += bytes(8)
        return self._slots[key]

    def _stub(self, symbol: tuple[int, ...], name: str) -> int:
        """Return the offset of a jump to a function of the process."""
        if name not in self._stubs:
            slot = self._slot(symbol, name)
            self._stubs[name] = len(self._code)
            self._code += _JUMP + bytes(4)
            self._write("<i", len(self._code) - 4, slot - len(self._code))
        return self._stubs[name]

    def _offset(self, symbol: tuple[int, ...]) -> int:
        if symbol[3] >= _FIRST_SPECIAL_SECTION or symbol[3] not in self._places:
            raise _Unknown
        return self._places[symbol[3]] + symbol[4]

    def _symbols(self) -> tuple[list[tuple[int, ...]], bytes]:
        for section in self._sections:
            if section[1] == _SYMBOLS:
                return list(iter_unpack(_SYMBOL, self._bytes(section))), self._content(section[6])
        raise _Unknown

    def _write(self, form: str, place: int, value: int) -> None:
        if not -(1 << 8 * calcsize(form) - 1) <= value < 1 << 8 * calcsize(form) - 1:
            raise _Unknown
        pack_into(form, self._code, place, value)

    def _align(self, size: int) -> None:
        self._code += bytes(-len(self._code) % size)

    def _content(self, index: int) -> bytes:
        return self._bytes(self._sections[index])

    def _bytes(self, section: tuple[int, ...]) -> bytes:
        return self._file[section[4] : section[4] + section[5]]

    def _name(self, section: tuple[int, ...]) -> str:
        return _text(self._names, section[0])


def _text(names: bytes, start: int) -> str:
    return names[start : names.index(b"\0", start)].decode()
