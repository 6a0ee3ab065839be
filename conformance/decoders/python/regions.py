"""The model `regions`: its records, its share of the state digest, and sampling (regions.md)."""

import struct
from dataclasses import dataclass, field
from typing import NamedTuple

from base import Base
from errors import Fault
from obscurance import blend, f32
from payload import as_number, is_finite
from rangecoder import RangeDecoder
from sampling import Vector
from tracks import REGIONS, RAW, RegionSet

ENTROPY = 3406  # error of entropy-coded bytes
NEAR = 0x53800000  # bits of 2^40
POLYNOMIALS = (1, 4, 9)  # by degree
DEGREES = (0, 1, 1, 1, 2, 2, 2, 2, 2)  # of polynomials
ROWS = ((0,), (0, 1, 2, 3), (0, 4, 5, 6, 7, 8, 9))  # by derivatives
CLASSES = (0, 1, 1, 1, 2, 2, 2, 2, 2, 2)  # of rows
NO_CENTRE = (0, 0, 0)


class Form(NamedTuple):
    """Which coefficients a region has (section 2.1), but for its centre."""

    derivatives: int
    degree: int
    signals: int

    def places(self) -> list[tuple[int, int, int]]:
        """Row, polynomial and signal of each coefficient, in order."""
        return [
            (row, k, s)
            for row in ROWS[self.derivatives]
            for k in range(POLYNOMIALS[self.degree])
            for s in range(self.signals)
        ]

    @property
    def coefficients(self) -> int:
        return len(ROWS[self.derivatives]) * POLYNOMIALS[self.degree] * self.signals

    @property
    def pairs(self) -> int:
        return (self.coefficients + 1) // 2


class Region(NamedTuple):
    """A region. Every f32 is kept as its bits."""

    box: tuple[int, ...]  # minimum, then maximum
    centre: tuple[int, ...] | None  # None of a centred region
    form: Form
    values: tuple[int, ...]

    def digest_bytes(self) -> bytes:
        derivatives, degree, signals = self.form
        bits = derivatives | degree << 2 | (signals - 1) << 4 | (self.centre is None) << 5
        words = (*self.box, *(self.centre or NO_CENTRE), bits)
        count = len(self.values)
        return struct.pack("<10I", *words) + struct.pack(f"<{count}h", *self.values) + bytes(2 * (count % 2))


@dataclass
class Content:
    """What a track holds: all regions, or none."""

    regions: list[Region] = field(default_factory=list)

    def digest_bytes(self) -> bytes:
        """[R-050]"""
        parts = [struct.pack("<I", len(self.regions))]
        parts.extend(region.digest_bytes() for region in self.regions)
        return b"".join(parts)


# ---- The record (section 4) ----


def read_regions(payload: bytes, base: Base) -> dict[int, Content]:
    """Check a payload whole; returns the content of its tracks after the frame."""
    if len(payload) < 16:
        raise Fault(3401)
    count, flags, base_frame, reserved = struct.unpack_from("<4I", payload)
    if flags != 1 or base_frame != 0 or reserved != 0:
        raise Fault(3402)
    at = 16 + 12 * count
    if at > len(payload):
        raise Fault(3401)

    contents: dict[int, Content] = {}
    previous_id = -1
    for track_id, size, reserved in struct.iter_unpack("<3I", payload[16:at]):
        track, _ = base.named(track_id, previous_id, REGIONS)  # [B-017]
        previous_id = track_id
        if reserved != 0:
            raise Fault(3402)
        if size > len(payload) - at:
            raise Fault(3401)
        section = payload[at : at + size]
        at += size
        read = read_raw if track.coding == RAW else read_packed
        contents[track_id] = Content(read(track, section))

    if at != len(payload):
        raise Fault(3401)
    return contents


# ---- Regions (section 5) ----


def check_box(box: tuple[int, ...]) -> None:
    """[R-020]"""
    if any(bits & 0x7FFFFFFF >= NEAR for bits in box):
        raise Fault(3403)
    if any(as_number(box[axis]) > as_number(box[axis + 3]) for axis in range(3)):
        raise Fault(3403)


def check_centre(box: tuple[int, ...], centre: tuple[int, ...]) -> None:
    """[R-021] of a region that is not centred."""
    for axis in range(3):
        # What lies between two numbers is finite.
        if not is_finite(centre[axis]):
            raise Fault(3403)
        if not as_number(box[axis]) <= as_number(centre[axis]) <= as_number(box[axis + 3]):
            raise Fault(3403)


class Pairs:
    """[R-023]: the pairs of the regions so far."""

    def __init__(self, track: RegionSet) -> None:
        self.capacity = track.capacity
        self.count = 0

    def add(self, form: Form) -> None:
        self.count += form.pairs
        if self.count > self.capacity:
            raise Fault(3407)


def value_of(track: RegionSet, code: int) -> int:
    """[R-024], [R-025]"""
    value = code * track.step
    if abs(value) > 32767:
        raise Fault(3405)
    return value


# ---- Coding `raw` (section 6) ----


def read_raw(track: RegionSet, section: bytes) -> list[Region]:
    at = 40 * track.count
    if len(section) < at:
        raise Fault(3401)
    pairs = Pairs(track)
    heads = []
    for words in struct.iter_unpack("<10I", section[:at]):
        box, centre, bits = words[:6], words[6:9], words[9]
        check_box(box)
        if bits >> 6:
            raise Fault(3402)
        form = Form(bits & 3, bits >> 2 & 3, 1 + (bits >> 4 & 1))
        if form.derivatives > 2 or form.degree > 2 or form.signals > track.signals:
            raise Fault(3404)
        if bits >> 5:
            if centre != NO_CENTRE:
                raise Fault(3402)
            heads.append((box, None, form))
        else:
            check_centre(box, centre)
            heads.append((box, centre, form))
        pairs.add(form)
    if len(section) - at != 2 * sum(form.coefficients for _, _, form in heads):
        raise Fault(3401)
    regions = []
    for box, centre, form in heads:
        codes = struct.unpack_from(f"<{form.coefficients}h", section, at)
        at += 2 * form.coefficients
        regions.append(Region(box, centre, form, tuple(value_of(track, code) for code in codes)))
    return regions


# ---- Coding `packed` (section 7) ----

OTHER = 0
DERIVATIVES = 1
DEGREE = 3
SIGNALS = 5
SIGNIFICANT = 6
SIGN = 78
PREFIX = 168
SUFFIX = 438
STARTS = bytes([128] * 456)  # q = 256 * 128 + 128


def read_packed(track: RegionSet, section: bytes) -> list[Region]:
    n = track.count
    bitmap_at = 24 * n
    at = bitmap_at + (n + 7) // 8
    if len(section) < at:
        raise Fault(3401)
    own = int.from_bytes(section[bitmap_at:at], "little")  # bit r of the bitmap is bit r of the number
    if own >> n:
        raise Fault(3402)
    coded_at = at + 12 * own.bit_count()
    if len(section) < coded_at:
        raise Fault(3401)
    centres = struct.iter_unpack("<3I", section[at:coded_at])
    heads: list[tuple[tuple[int, ...], tuple[int, ...] | None]] = []
    for r, box in enumerate(struct.iter_unpack("<6I", section[:bitmap_at])):
        check_box(box)
        centre = next(centres) if own >> r & 1 else None
        if centre is not None:
            check_centre(box, centre)
        heads.append((box, centre))

    coder = RangeDecoder(section[coded_at:], STARTS, ENTROPY)
    syntax = Syntax(track, coder)
    regions = []
    for box, centre in heads:
        form, values = syntax.region()
        regions.append(Region(box, centre, form, values))
    coder.finish()
    return regions


class Syntax:
    """[R-044]: the program of section 7."""

    def __init__(self, track: RegionSet, coder: RangeDecoder) -> None:
        self.track = track
        self.coder = coder
        self.pairs = Pairs(track)
        self.follow = [coder.even() for _ in range(3)]
        self.form = Form(0, 0, 1)
        self.last: dict[tuple[int, int, int], tuple[int, int]] = {}  # code, magnitude of the residual

    def three(self, context: int) -> int:
        if not self.coder.bit(context):
            return 0
        return 1 + self.coder.bit(context + 1)

    def region(self) -> tuple[Form, tuple[int, ...]]:
        if self.coder.bit(OTHER):
            derivatives = self.three(DERIVATIVES)
            degree = self.three(DEGREE)
            signals = 1
            if self.track.signals == 2:
                signals = 1 + self.coder.bit(SIGNALS)
            self.form = Form(derivatives, degree, signals)
        self.pairs.add(self.form)
        values = tuple(self.value(*place) for place in self.form.places())
        return self.form, values

    def value(self, row: int, k: int, s: int) -> int:
        group = (3 * s + CLASSES[row]) * 3 + DEGREES[k]
        last, size = self.last.get((row, k, s), (0, 0))
        code = last if self.follow[CLASSES[row]] else 0
        magnitude = 0
        if self.coder.bit(SIGNIFICANT + 4 * group + min(size.bit_length(), 3)):
            negative = self.coder.bit(SIGN + 9 * row + k)
            magnitude = self.magnitude(group)
            code += -magnitude if negative else magnitude
        value = value_of(self.track, code)
        self.last[row, k, s] = code, magnitude
        return value

    def magnitude(self, group: int) -> int:
        length = 0
        while length < 15 and self.coder.bit(PREFIX + 15 * group + length):
            length += 1
        magnitude = 1
        for i in reversed(range(length)):
            bit = self.coder.bit(SUFFIX + group) if i == length - 1 else self.coder.even()
            magnitude = 2 * magnitude + bit
        return magnitude


# ---- Sampling (section 10) ----


def ambient_occlusion(track: RegionSet, content: Content, p: Vector, normal: Vector) -> float:
    """[R-060] to [R-063]: the AO at a position with a unit normal."""
    if not content.regions:
        return 1.0
    region = look_up(content.regions, p)
    functions = polynomials(normal)
    u = offsets(region, p)
    signals = []
    for s in range(track.signals):
        own = min(s, region.form.signals - 1)
        signal = 0.0
        for (row, k, of), value in zip(region.form.places(), region.values, strict=True):
            if of == own:
                coefficient = value / 32767 * 2**track.exponent
                signal += coefficient * share(row, u) * functions[k]
        signals.append(min(max(signal, 0.0), 1.0))
    return blend(track, signals)


def corners(region: Region) -> tuple[list[float], list[float]]:
    values = [f32(bits) for bits in region.box]
    return values[:3], values[3:]


def look_up(regions: list[Region], p: Vector) -> Region:
    """[R-060]: the first of the least distance and volume."""

    def distance_and_volume(region: Region) -> tuple[float, float]:
        low, high = corners(region)
        away = [at - min(max(at, a), b) for at, a, b in zip(p, low, high, strict=True)]
        x, y, z = (b - a for a, b in zip(low, high, strict=True))
        return sum(d * d for d in away), x * y * z

    return min(regions, key=distance_and_volume)


def offsets(region: Region, p: Vector) -> list[float]:
    """[R-061]"""
    low, high = corners(region)
    u = []
    for axis in range(3):
        half = (high[axis] - low[axis]) / 2
        centre = (low[axis] + high[axis]) / 2 if region.centre is None else f32(region.centre[axis])
        at = min(max(p[axis], low[axis]), high[axis])
        u.append((at - centre) / half if half > 0 else 0.0)
    return u


def share(row: int, u: list[float]) -> float:
    """[R-062]: what a row is multiplied by."""
    if row == 0:
        return 1.0
    if row < 4:
        return u[row - 1]
    axis, negative = divmod(row - 4, 2)
    return u[axis] if (u[axis] < 0) == bool(negative) else 0.0


def polynomials(normal: Vector) -> tuple[float, ...]:
    """Section 2."""
    x, y, z = normal
    return (1.0, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y)
