"""The model `points`: its records and its share of the state digest (points.md)."""

import struct
from dataclasses import dataclass, field

from base import Base
from errors import Fault
from tracks import POINTS, Grid

EMPTY = 0xFFFFFFFF
KEYFRAME = 1

Cell = tuple[int, tuple[int, ...]]  # a key and seven points; a point that is not there is 0


@dataclass
class Content:
    """What a track holds. Empty buckets and free cells are left out."""

    buckets: dict[int, tuple[int, ...]] = field(default_factory=dict)  # cell indices, 1 to 8
    cells: dict[int, Cell] = field(default_factory=dict)

    def digest_bytes(self) -> bytes:
        """[P-031]: the buckets that have entries, each with its cells by value."""
        parts = []
        for index in sorted(self.buckets):
            entries = self.buckets[index]
            parts.append(struct.pack("<II", index, len(entries)))
            for entry in entries:
                key, points = self.cells[entry]
                parts.append(struct.pack("<8I", key, *points))
        return b"".join(parts)


def cube_hash(track: Grid, x: int, y: int, z: int) -> int:
    """[P-005]: the bucket of a cube."""
    dx, dy, _ = track.dims
    h = (x + y * (dx * 17) + z * (dx * dy * 31)) % 2**32
    return h % track.bucket_count


def key_hash(track: Grid, key: int) -> int:
    """[P-005], back from the key: the bucket of a cube by its key."""
    dx, dy, _ = track.dims
    return cube_hash(track, key % dx, key // dx % dy, key // (dx * dy))


# ---- The record (section 5) ----


def read_points(payload: bytes, base: Base) -> dict[int, Content]:
    """Check a payload whole; returns the content of its tracks after the frame."""
    if len(payload) < 16:  # [P-010]
        raise Fault(3001)
    count, flags, base_frame, reserved = struct.unpack_from("<4I", payload)
    keyframe = bool(flags & KEYFRAME)
    if flags > KEYFRAME or reserved != 0 or (keyframe and base_frame != 0):  # [P-011]
        raise Fault(3002)
    base.check_frame(keyframe, base_frame)  # [P-012]
    at = 16 + 12 * count
    if at > len(payload):  # [P-010]
        raise Fault(3001)

    contents: dict[int, Content] = {}
    previous_id = -1
    for track_id, bucket_total, cell_total in struct.iter_unpack("<3I", payload[16:at]):
        track, committed = base.named(track_id, previous_id, POINTS)  # [P-013]
        previous_id = track_id
        sections, at = read_sections(payload, at, bucket_total, cell_total, track.point_bits // 8)
        contents[track_id] = check_track(track, sections, None if keyframe else committed)

    if at != len(payload):  # [P-010]
        raise Fault(3001)
    return contents


@dataclass
class Sections:
    """The sections of one track, as they stand in the payload."""

    bucket_indices: list[int]
    buckets: list[tuple[int, ...]]  # eight entries each
    cell_indices: list[int]
    keys: tuple[int, ...]
    points: list[tuple[int, ...]]  # seven a cell


def read_sections(
    payload: bytes, at: int, bucket_total: int, cell_total: int, width: int
) -> tuple[Sections, int]:
    """Step 5: the sections lie in the payload, and so does the padding, which is 0."""
    point_bytes = 7 * cell_total * width
    padding = -point_bytes % 4
    if 36 * bucket_total + 8 * cell_total + point_bytes + padding > len(payload) - at:  # [P-010]
        raise Fault(3001)

    def numbers(total: int) -> tuple[int, ...]:
        nonlocal at
        values = struct.unpack_from(f"<{total}I", payload, at)
        at += 4 * total
        return values

    bucket_indices = from_gaps(numbers(bucket_total))
    buckets = by_size(numbers(8 * bucket_total), 8)
    cell_indices = from_gaps(numbers(cell_total))
    keys = numbers(cell_total)
    points = by_size(read_numbers(payload[at : at + point_bytes], width), 7)
    at += point_bytes
    if any(payload[at : at + padding]):  # [P-011]
        raise Fault(3002)
    return Sections(bucket_indices, buckets, cell_indices, keys, points), at + padding


def from_gaps(gaps: tuple[int, ...]) -> list[int]:
    """[P-006]: the ascending indices that gaps stand for."""
    indices = []
    next_index = 0
    for gap in gaps:
        indices.append(next_index + gap)
        next_index += gap + 1
    return indices


def by_size(values: tuple[int, ...], size: int) -> list[tuple[int, ...]]:
    return [values[at : at + size] for at in range(0, len(values), size)]


def read_numbers(data: bytes, width: int) -> tuple[int, ...]:
    """Unsigned numbers of 2, 3 or 4 bytes."""
    if width == 3:
        return tuple(int.from_bytes(data[at : at + 3], "little") for at in range(0, len(data), 3))
    return struct.unpack(f"<{len(data) // width}{'H' if width == 2 else 'I'}", data)


def check_track(track: Grid, new: Sections, committed: Content | None) -> Content:
    """[P-020] to [P-030]: the content of a track after the frame.

    `committed` is what a delta changes, and None in a keyframe.
    """
    # Indices ascend, so the last one tells.
    if new.bucket_indices and new.bucket_indices[-1] >= track.bucket_count:  # [P-020]
        raise Fault(3003)
    if new.cell_indices and new.cell_indices[-1] >= track.cell_capacity:  # [P-021]
        raise Fault(3004)

    before = committed or Content()
    after = Content(dict(before.buckets), dict(before.cells))
    after.buckets.update(zip(new.bucket_indices, new.buckets))

    for index, key, points in zip(new.cell_indices, new.keys, new.points):
        check_cell(track, key, points)
        if index in before.cells:
            check_moved(track, index, before.cells[index][0], key, after)  # [P-026]
        if key == EMPTY:
            after.cells.pop(index, None)
        else:
            after.cells[index] = (key, points)

    for index, entries in zip(new.bucket_indices, new.buckets):
        used = check_bucket(track, index, entries, after)
        if used:
            after.buckets[index] = used
        else:
            del after.buckets[index]
    return after


def check_cell(track: Grid, key: int, points: tuple[int, ...]) -> None:
    """[P-022] to [P-025]."""
    if key != EMPTY and key >= track.cubes:  # [P-022]
        raise Fault(3008)
    there = 1 << (track.point_bits - 1)
    for point in points:
        if point and not point & there:  # [P-023]
            raise Fault(3010)
    used = 7 - points.count(0)
    if 0 in points[:used]:  # [P-024]
        raise Fault(3009)
    if key == EMPTY and used:  # [P-025]
        raise Fault(3011)


def check_moved(track: Grid, index: int, old_key: int, key: int, after: Content) -> None:
    """[P-026]: a cell that leaves its bucket is not named there any more."""
    if key == old_key:
        return
    old_bucket = key_hash(track, old_key)
    if key != EMPTY and key_hash(track, key) == old_bucket:
        return
    if index in after.buckets.get(old_bucket, ()):
        raise Fault(3013)


def check_bucket(
    track: Grid, index: int, entries: tuple[int, ...], after: Content
) -> tuple[int, ...]:
    """[P-027] to [P-030]; returns the entries up to the first EMPTY."""
    used = entries[: 8 - entries.count(EMPTY)]
    if EMPTY in used:  # [P-027]
        raise Fault(3006)
    for position, cell in enumerate(used):
        if cell >= track.cell_capacity:  # [P-028]
            raise Fault(3005)
        if cell not in after.cells or key_hash(track, after.cells[cell][0]) != index:  # [P-029]
            raise Fault(3012)
        if cell in used[:position]:  # [P-030]
            raise Fault(3007)
    return used
