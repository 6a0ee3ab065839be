"""The model `vertices`: its records, its share of the state digest, and sampling (vertices.md)."""

import struct
from dataclasses import dataclass

from base import Base
from errors import Fault
from obscurance import blend
from tracks import RAW, VERTICES, VertexSet


@dataclass
class Content:
    """What a track holds: a byte for each value; none where it is open."""

    size: int
    coded: bytes | None = None

    def values(self) -> bytes:
        return b"\xff" * self.size if self.coded is None else self.coded

    def digest_bytes(self) -> bytes:
        """[V-040]"""
        return self.values()


# ---- The record (section 4) ----


def read_vertices(payload: bytes, base: Base) -> dict[int, Content]:
    """Check a payload whole; returns the content of its tracks after the frame."""
    if len(payload) < 16:  # [V-011]
        raise Fault(3201)
    count, flags, base_frame, reserved = struct.unpack_from("<4I", payload)
    if flags != 1 or base_frame != 0 or reserved != 0:  # [V-012]
        raise Fault(3202)
    at = 16 + 12 * count
    if at > len(payload):  # [V-011]
        raise Fault(3201)

    contents: dict[int, Content] = {}
    previous_id = -1
    for track_id, size, reserved in struct.iter_unpack("<3I", payload[16:at]):
        track, _ = base.named(track_id, previous_id, VERTICES)  # [V-013], [B-017]
        previous_id = track_id
        if reserved != 0:  # [V-012]
            raise Fault(3202)
        if size > len(payload) - at or size != section_bytes(track):  # [V-011]
            raise Fault(3201)
        section = payload[at : at + size]
        at += size
        codes = raw_codes(track, section) if track.coding == RAW else packed_codes(track, section)
        contents[track_id] = Content(track.values, values_of(track, codes))  # [V-010]

    if at != len(payload):  # [V-011]
        raise Fault(3201)
    return contents


def section_bytes(track: VertexSet) -> int:
    if track.coding == RAW and track.bits == 5:
        return (5 * track.values + 7) // 8
    return track.values


def values_of(track: VertexSet, codes: bytes) -> bytes:
    """[V-020]"""
    if track.bits == 8:
        return codes
    return bytes((255 * code + 15) // 31 for code in codes)


# ---- Coding `raw` (section 5) ----


def raw_codes(track: VertexSet, section: bytes) -> bytes:
    if track.bits == 8:
        return section
    bits = int.from_bytes(section, "little")  # bit b of code k is bit 5 k + b of the number
    if bits >> (5 * track.values):  # [V-021]
        raise Fault(3202)
    return bytes(bits >> (5 * k) & 31 for k in range(track.values))


# ---- Coding `packed` (section 6) ----


def packed_codes(track: VertexSet, section: bytes) -> bytes:
    """[V-030]"""
    most = 2**track.bits - 1
    if any(difference > most for difference in section):  # [V-031]
        raise Fault(3205)
    codes = bytearray(track.values)
    for signal in range(track.signals):
        code = most
        for vertex in range(track.count):
            code = (code + section[signal * track.count + vertex]) % (most + 1)
            codes[vertex * track.signals + signal] = code
    return bytes(codes)


# ---- Sampling (section 9) ----


def ambient_occlusion(
    track: VertexSet, content: Content, corners: list[int], weights: list[float]
) -> float:
    """[V-050]"""
    values = content.values()
    signals = [
        sum(w * values[corner * track.signals + signal] for w, corner in zip(weights, corners)) / 255
        for signal in range(track.signals)
    ]
    return blend(track, signals)
