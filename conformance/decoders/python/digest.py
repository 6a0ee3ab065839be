"""CRC-32C and XXH64 (README.md, "Conventions")."""

import struct

# ---- CRC-32C, one byte a step ----


def _crc_entry(byte: int) -> int:
    crc = byte
    for _ in range(8):
        crc = (crc >> 1) ^ (0x82F63B78 if crc & 1 else 0)
    return crc


_CRC_TABLE = tuple(_crc_entry(byte) for byte in range(256))


def crc32c(data: bytes) -> int:
    """The Castagnoli CRC: initial value and final XOR 0xffffffff."""
    table = _CRC_TABLE
    crc = 0xFFFFFFFF
    for byte in data:
        crc = table[(crc ^ byte) & 0xFF] ^ (crc >> 8)
    return crc ^ 0xFFFFFFFF


# ---- XXH64, seed 0 ----

_P1 = 0x9E3779B185EBCA87
_P2 = 0xC2B2AE3D27D4EB4F
_P3 = 0x165667B19E3779F9
_P4 = 0x85EBCA77C2B2AE63
_P5 = 0x27D4EB2F165667C5
_MASK = 0xFFFFFFFFFFFFFFFF


def _rotate(value: int, count: int) -> int:
    return ((value << count) | (value >> (64 - count))) & _MASK


def _round(lane: int, word: int) -> int:
    return _rotate((lane + word * _P2) & _MASK, 31) * _P1 & _MASK


class Xxh64:
    """XXH64 with seed 0 over bytes that come in pieces."""

    def __init__(self) -> None:
        self.lanes = [(_P1 + _P2) & _MASK, _P2, 0, -_P1 & _MASK]
        self.length = 0
        self.tail = b""  # fewer than 32 bytes that wait for more

    def update(self, data: bytes) -> None:
        """Take in more bytes: whole stripes of 32 now, the rest later."""
        self.length += len(data)
        data = self.tail + data
        whole = len(data) // 32 * 32
        self.tail = data[whole:]
        a, b, c, d = self.lanes
        for w, x, y, z in struct.iter_unpack("<4Q", data[:whole]):
            a, b, c, d = _round(a, w), _round(b, x), _round(c, y), _round(d, z)
        self.lanes = [a, b, c, d]

    def value(self) -> int:
        """The hash of all bytes so far."""
        if self.length >= 32:
            a, b, c, d = self.lanes
            h = (_rotate(a, 1) + _rotate(b, 7) + _rotate(c, 12) + _rotate(d, 18)) & _MASK
            for lane in self.lanes:
                h = ((h ^ _round(0, lane)) * _P1 + _P4) & _MASK
        else:
            h = _P5
        h = (h + self.length) & _MASK
        tail = self.tail
        at = 0
        while at + 8 <= len(tail):
            word = int.from_bytes(tail[at : at + 8], "little")
            h = (_rotate(h ^ _round(0, word), 27) * _P1 + _P4) & _MASK
            at += 8
        if at + 4 <= len(tail):
            word = int.from_bytes(tail[at : at + 4], "little")
            h = (_rotate(h ^ (word * _P1 & _MASK), 23) * _P2 + _P3) & _MASK
            at += 4
        for byte in tail[at:]:
            h = _rotate(h ^ (byte * _P5 & _MASK), 11) * _P1 & _MASK
        h = (h ^ (h >> 33)) * _P2 & _MASK
        h = (h ^ (h >> 29)) * _P3 & _MASK
        return h ^ (h >> 32)


def xxh64(data: bytes) -> int:
    """XXH64 with seed 0 of bytes that are all there."""
    hasher = Xxh64()
    hasher.update(data)
    return hasher.value()
