"""Reading of the fields of a payload, in the order of their offsets (container.md, section 6)."""

import struct

from errors import Fault

_U16 = struct.Struct("<H")
_U32 = struct.Struct("<I")
_U64 = struct.Struct("<Q")


def is_finite(bits: int) -> bool:
    """[C-042], on the bits of an f32: the exponent is not all ones."""
    return bits & 0x7F800000 != 0x7F800000


def as_number(bits: int) -> int:
    """An integer that compares as the finite f32 with these bits does; -0 equals 0."""
    magnitude = bits & 0x7FFFFFFF
    return -magnitude if bits >> 31 else magnitude


class Fields:
    """The bytes from `at` to `end` of a payload. A field that does not fit is error 2001 [C-040]."""

    def __init__(self, data: bytes, at: int = 0, end: int | None = None) -> None:
        self.data = data
        self.at = at
        self.end = len(data) if end is None else end

    def left(self) -> int:
        return self.end - self.at

    def _step(self, size: int) -> int:
        at = self.at
        if size > self.end - at:
            raise Fault(2001)
        self.at = at + size
        return at

    def u8(self) -> int:
        return self.data[self._step(1)]

    def u16(self) -> int:
        return _U16.unpack_from(self.data, self._step(2))[0]

    def u32(self) -> int:
        return _U32.unpack_from(self.data, self._step(4))[0]

    def u64(self) -> int:
        return _U64.unpack_from(self.data, self._step(8))[0]

    def f32(self) -> int:
        """The bits of a finite f32, error 2009 for another [C-042]."""
        bits = self.u32()
        if not is_finite(bits):
            raise Fault(2009)
        return bits

    def f32s(self, count: int) -> tuple[int, ...]:
        return tuple(self.f32() for _ in range(count))

    def bytes(self, size: int) -> bytes:
        at = self._step(size)
        return self.data[at : at + size]

    def zero(self, size: int) -> None:
        """A reserved field, or padding [C-041]."""
        if any(self.bytes(size)):
            raise Fault(2002)

    def nothing_left(self) -> None:
        if self.at != self.end:
            raise Fault(2001)
