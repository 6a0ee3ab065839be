"""The model `instances`: its records, its share of the state digest, and sampling (instances.md)."""

import struct
from dataclasses import dataclass, field
from typing import NamedTuple

from base import Base
from digest import xxh64
from errors import Fault
from obscurance import blend, f32
from rangecoder import RangeDecoder
from tracks import INSTANCES, RAW, Table

ENTROPY = 3306  # error of entropy-coded bytes


class Entry(NamedTuple):
    """What a table has of an instance."""

    key: int
    values: tuple[tuple[int, ...], ...]  # four for each signal


@dataclass
class Content:
    """What a track holds: all entries, or none."""

    entries: list[Entry] = field(default_factory=list)

    def digest_bytes(self) -> bytes:
        """[I-050]"""
        parts = [struct.pack("<I", len(self.entries))]
        for key, values in self.entries:
            parts.append(struct.pack("<Q", key))
            parts.extend(struct.pack("<4h", *signal) for signal in values)
        return b"".join(parts)


# ---- The record (section 4) ----


def read_instances(payload: bytes, base: Base) -> dict[int, Content]:
    """Check a payload whole; returns the content of its tracks after the frame."""
    if len(payload) < 16:  # [I-013]
        raise Fault(3301)
    count, flags, base_frame, reserved = struct.unpack_from("<4I", payload)
    if flags != 1 or base_frame != 0 or reserved != 0:  # [I-014]
        raise Fault(3302)
    at = 16 + 12 * count
    if at > len(payload):  # [I-013]
        raise Fault(3301)

    contents: dict[int, Content] = {}
    previous_id = -1
    for track_id, size, reserved in struct.iter_unpack("<3I", payload[16:at]):
        track, _ = base.named(track_id, previous_id, INSTANCES)  # [I-016], [B-017]
        previous_id = track_id
        if reserved != 0:  # [I-014]
            raise Fault(3302)
        if size > len(payload) - at:  # [I-013]
            raise Fault(3301)
        section = payload[at : at + size]
        at += size
        read = read_raw if track.coding == RAW else read_packed
        contents[track_id] = Content(read(track, section))  # [I-010]

    if at != len(payload):  # [I-013]
        raise Fault(3301)
    return contents


def value_of(track: Table, code: int) -> int:
    """[I-025], [I-026]"""
    value = code * track.step
    if abs(value) > 32767:
        raise Fault(3305)
    return value


# ---- Coding `raw` (section 5) ----


def read_raw(track: Table, section: bytes) -> list[Entry]:
    n = track.count
    forms_at = 8 * n
    at = forms_at + (n + 7) // 8
    if len(section) < at:  # [I-021]
        raise Fault(3301)
    forms = int.from_bytes(section[forms_at:at], "little")  # bit i of the bitmap is bit i of the number
    if forms >> n:  # [I-022]
        raise Fault(3302)
    if len(section) - at != 2 * track.signals * (n + 3 * forms.bit_count()):  # [I-023]
        raise Fault(3301)
    entries: list[Entry] = []
    for i, (key,) in enumerate(struct.iter_unpack("<Q", section[:forms_at])):
        if entries and key <= entries[-1].key:  # [I-024]
            raise Fault(3303)
        coded = 4 if forms >> i & 1 else 1
        values = []
        for _ in range(track.signals):
            codes = struct.unpack_from(f"<{coded}h", section, at)
            at += 2 * coded
            values.append(tuple(value_of(track, code) for code in codes) + (0,) * (4 - coded))
        entries.append(Entry(key, tuple(values)))
    return entries


# ---- Coding `packed` (section 6) ----

KEY = 0
FORM = 1
SIGNIFICANT = 3
SIGN = 7
PREFIX = 11
SUFFIX = 43

STARTS = bytes(
    int(number)
    for number in """
    140 180  40   8  11   8  11 128 128 128 128   8  16  33  63 123
    196 240 240  21  43  84 142 215 248 240 240   8  16  33  63 123
    196 240 240  21  43  84 142 215 248 240 240 152 152 152 152
    """.split()
)
assert len(STARTS) == 47


def read_packed(track: Table, section: bytes) -> list[Entry]:
    """[I-030]"""
    bits = RangeDecoder(section, STARTS, ENTROPY)  # [I-033]
    b = (track.count - 1).bit_length()
    if 8 * (len(section) + 1) < track.count * (64 - b):  # [I-035]
        raise Fault(ENTROPY)
    following = 0
    form = 0
    # [I-031]: of each signal and coefficient the sum of codes and their number.
    sums = [[24575 // (track.step << track.exponent), 0, 0, 0] for _ in range(track.signals)]
    counts = [[1] * 4 for _ in range(track.signals)]
    entries: list[Entry] = []
    for _ in range(track.count):
        q = 0
        while bits.bit(KEY):
            q += 1
            if q >= 2**b:  # [I-032]
                raise Fault(3303)
        low = 0
        for _ in range(64 - b):
            low = 2 * low + bits.even()
        key = following + (q << (64 - b)) + low
        if key >= 2**64:  # [I-032]
            raise Fault(3303)
        following = key + 1
        form = bits.bit(FORM + form)
        values = []
        for s in range(track.signals):
            signal = [0] * 4
            for i in range(4 if form else 1):
                code = sums[s][i] // counts[s][i] + read_residual(bits, 2 * s + min(i, 1))
                signal[i] = value_of(track, code)
                sums[s][i] += code
                counts[s][i] += 1
            values.append(tuple(signal))
        entries.append(Entry(key, tuple(values)))
    bits.finish()  # [I-034]
    return entries


def read_residual(bits: RangeDecoder, g: int) -> int:
    if not bits.bit(SIGNIFICANT + g):
        return 0
    negative = bits.bit(SIGN + g)
    e = 0
    while e < 15 and bits.bit(PREFIX + 8 * g + min(e, 7)):
        e += 1
    m = 1
    for k in range(e):
        m = 2 * m + (bits.bit(SUFFIX + g) if k == 0 else bits.even())
    return -m if negative else m


# ---- Sampling (section 8) ----


def ambient_occlusion(
    track: Table, content: Content, path: str, p: tuple[float, ...], local: float
) -> float:
    """[I-064]"""
    return min(global_obscurance(track, content, path, p) * local, 1.0)


def global_obscurance(track: Table, content: Content, path: str, p: tuple[float, ...]) -> float:
    """G of the instance of a path."""
    key = xxh64(path.encode("utf-8"))  # [I-060]
    found = [values for each, values in content.entries if each == key]
    if not found:
        return 1.0
    u = []
    for axis in range(3):  # [I-062]
        low, high = f32(track.aabb[axis]), f32(track.aabb[axis + 3])
        inside = (p[axis] - (low + high) / 2) / ((high - low) / 2) if low < high else 0.0
        u.append(max(-1.0, min(inside, 1.0)))
    signals = []
    for values in found[0]:
        c = [value / 32767 * 2**track.exponent for value in values]  # [I-061]
        signals.append(max(c[0] + c[1] * u[0] + c[2] * u[1] + c[3] * u[2], 0.0))  # [I-063]
    return blend(track, signals)
