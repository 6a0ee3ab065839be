"""The model `probes`: its records, its values and its share of the state digest (probes.md)."""

import struct
from dataclasses import dataclass, field
from math import isqrt
from typing import NamedTuple, Protocol

from base import Base
from errors import Fault
from rangecoder import RangeDecoder
from tracks import PROBES, RAW, Volume

KEYFRAME = 1
ENTROPY = 3105  # error of entropy-coded bytes
REACH = 4  # most steps from an absent probe that is filled to a present one
VISIBILITY = 1
NO_CODES = (0,) * 27


class Probe(NamedTuple):
    """A probe that is present."""

    level: int  # 1 to 3
    codes: tuple[int, ...]  # 27; in the coding `raw` the bits of its values


ABSENT = Probe(0, NO_CODES)


@dataclass
class Content:
    """What a track holds. Absent probes are left out."""

    probes: dict[int, Probe] = field(default_factory=dict)
    visibility: bytes | None = None

    def probe(self, index: int) -> Probe:
        return self.probes.get(index, ABSENT)

    def digest_bytes(self) -> bytes:
        """[B-062]"""
        parts = []
        for index in sorted(self.probes):
            level, codes = self.probes[index]
            parts.append(struct.pack("<2I27H2x", index, level, *(code & 0xFFFF for code in codes)))
        parts.append(struct.pack("<I", self.visibility is not None))
        parts.append(self.visibility or b"")
        return b"".join(parts)


# ---- The record (section 4) ----


def read_probes(payload: bytes, base: Base) -> dict[int, Content]:
    """Check a payload whole; returns the content of its tracks after the frame."""
    if len(payload) < 16:  # [B-013]
        raise Fault(3101)
    count, flags, base_frame, reserved = struct.unpack_from("<4I", payload)
    keyframe = bool(flags & KEYFRAME)
    if flags > KEYFRAME or reserved != 0 or (keyframe and base_frame != 0):  # [B-014]
        raise Fault(3102)
    base.check_frame(keyframe, base_frame)  # [B-015]
    at = 16 + 12 * count
    if at > len(payload):  # [B-013]
        raise Fault(3101)

    contents: dict[int, Content] = {}
    previous_id = -1
    for track_id, size, flags in struct.iter_unpack("<3I", payload[16:at]):
        track, committed = base.named(track_id, previous_id, PROBES)  # [B-016], [B-017]
        previous_id = track_id
        if flags > VISIBILITY or (flags and track.side == 0):  # [B-014]
            raise Fault(3102)
        if size > len(payload) - at:  # [B-013]
            raise Fault(3101)
        section = payload[at : at + size]
        at += size
        before = Content() if keyframe else committed
        read = read_raw if track.coding == RAW else read_packed
        contents[track_id] = read(track, section, before, bool(flags))

    if at != len(payload):  # [B-013]
        raise Fault(3101)
    return contents


# ---- Coding `raw` (section 5) ----


def read_raw(track: Volume, section: bytes, before: Content, seeing: bool) -> Content:
    """The content after the frame; `seeing` tells that the section has visibility."""
    visibility = before.visibility  # [B-011]
    if seeing:
        if len(section) < track.visibility_bytes:  # [B-013]
            raise Fault(3101)
        visibility = section[: track.visibility_bytes]  # [B-061]
        section = section[track.visibility_bytes :]
    size = (track.probes + 7) // 8
    if len(section) < 2 * size:  # [B-021]
        raise Fault(3101)
    changed = int.from_bytes(section[:size], "little")  # bit p of the bitmap is bit p of the number
    present = int.from_bytes(section[size : 2 * size], "little")
    if changed >> track.probes or present & ~changed:  # [B-022]
        raise Fault(3102)
    at = 2 * size
    if len(section) - at != 56 * present.bit_count():  # [B-023]
        raise Fault(3101)

    after = dict(before.probes)
    for index in range(track.probes):  # [B-020]
        if present >> index & 1:
            *values, reserved = struct.unpack_from("<28H", section, at)
            at += 56
            if any(value & 0x7C00 == 0x7C00 for value in values):  # [B-024]
                raise Fault(3103)
            if any(value >> 15 for value in values[:3]):
                raise Fault(3103)
            if reserved != 0:  # [B-025]
                raise Fault(3102)
            after[index] = Probe(3, tuple(values))
        elif changed >> index & 1:
            after.pop(index, None)
    return Content(after, visibility)


# ---- Coding `packed`: its bits (section 6.2) ----


class Bits(Protocol):
    """Where bits come from: a range decoder, or a test."""

    def bit(self, context: int) -> int: ...
    def even(self) -> int: ...


# ---- Coding `packed`: contexts (section 6.4) ----


class Contexts:
    """A family of contexts: the number of each by its indices, the last index fastest."""

    total = 0

    def __init__(self, *shape: int) -> None:
        self.shape = shape
        self.first = Contexts.total
        size = 1
        for extent in shape:
            size *= extent
        Contexts.total += size

    def __call__(self, *indices: int) -> int:
        offset = 0
        for extent, index in zip(self.shape, indices, strict=True):
            assert 0 <= index < extent
            offset = offset * extent + index
        return self.first + offset


CHANGED = Contexts(2, 4)
OTHER = Contexts()
LEVEL = Contexts(4, 2)
ANY = Contexts(2, 6, 4, 2)
SOME = Contexts(2, 6, 4)
AGAINST = Contexts(2, 2, 3)
LONGER = Contexts(2, 6, 6)
SECOND = Contexts(2, 6)
MAP_CHANGED = Contexts(2, 4)
MAP_DEVIATES = Contexts()
MAP_SIGNIFICANT = Contexts(2, 8, 3, 4)
MAP_SIGN = Contexts(2, 8, 3)
MAP_PREFIX = Contexts(2, 8, 7)
MAP_SUFFIX = Contexts(2, 7)

# The numbers b at the start, in the order of the families.
STARTS = bytes(
    int(number)
    for number in """
    196 117  69  17 251 247 129   4 251 251 128 128 128 128 128 128
    128 183 128 148 128  85 128  34 128 215 217 183 180 137 121  80
     51 113 139  99  97  70  53  45  25 199 206 172 167 146 122 105
     68 179 168 148 128 112  83  81  46 235 228 204 186 174 139 127
     83  33 128  14 128  14 128  13 128 137  68  51  40  45  33  21
     28 128  25   5   4   4   4   4   4 128  40 128  14  64   5  18
      4 128  21  30   4  10   4   8   4 128 130  51  53  64  17  32
     12 128 128 128 128 179  56  14   4 176 146  96  50 218 158 100
     50 203 171 127  75 229 185 148  92 128 128 128 128 122  71  61
     46  42  25  24  23 137 100  92  72  75  53  49  42 198 135 125
     95 121 214 248 123 234 251 138 140 160 179 147 173 195 215 218
    227 235 180 240 233 229 199 112 121 226 228 227 214 207 168 249
    238 220 152  98 163 246 239 224 198 160 164 251 226 136  97 188
    182  26  56 108 171 203 207 154 196 206 211 198 144  49  96 154
    193 217 218 177 203 201 200 190 200 101 163 194 217 222 221 218
    208 201 195 148 200 205 216 211 219 218 221 152 195 160 198 174
    196 248 160 112  64 107  49  10   4 251 251 225 236 240 246 201
    202 209 237 182 189 205 237 179 187 194 233 160 169 180 222 186
    184 192 230 152 163 182 207 140 142 147 201 134 131 139 224 133
    143 170 191 110 110 120 157 100  93 100 217 122 122 159 174  91
     86 103 130  70  61  65 208 129 112 147 160  85  69  88 108  51
     42  46 189 137  98 136 143  79  59  75  93  38  31  34 158 140
     99 108 108  73  54  60  66  25  24  24 251 225 236 240 246 201
    202 209 237 182 189 205 237 179 187 194 233 160 169 180 222 186
    184 192 230 152 163 182 207 140 142 147 201 134 131 139 224 133
    143 170 191 110 110 120 157 100  93 100 217 122 122 159 174  91
     86 103 130  70  61  65 208 129 112 147 160  85  69  88 108  51
     42  46 189 137  98 136 143  79  59  75  93  38  31  34 158 140
     99 108 108  73  54  60  66  25  24  24  95 125 164  85 132 149
     68 132 165  65 130 167  63 124 170  61 121 169  59 119 171  54
    118 176  95 125 164  85 132 149  68 132 165  65 130 167  63 124
    170  61 121 169  59 119 171  54 118 176 115 114 129 146 166 183
    204 153 152 168 185 195 232 220 130 143 161 177 196 217 237 101
    135 162 180 194 217 249  68 106 150 179 196 221 247  42  71 116
    165 197 223 246  25  43  75 128 182 218 245  14  23  41  73 126
    187 233 115 114 129 146 166 183 204 153 152 168 185 195 232 220
    130 143 161 177 196 217 237 101 135 162 180 194 217 249  68 106
    150 179 196 221 247  42  71 116 165 197 223 246  25  43  75 128
    182 218 245  14  23  41  73 126 187 233 155 159 166 172 180 203
    186 155 159 166 172 180 203 186
    """.split()
)
assert len(STARTS) == Contexts.total == 632


# ---- Coding `packed`: syntax (sections 6.1 and 6.3) ----

GROUPS = (range(0, 1), range(1, 3), range(3, 6), range(6, 12), range(12, 17), range(17, 27))


def read_packed(track: Volume, section: bytes, before: Content, seeing: bool) -> Content:
    """The content after the frame; `seeing` tells that the section has visibility."""
    bits = RangeDecoder(section, STARTS, ENTROPY)
    visibility = before.visibility  # [B-011]
    if seeing:
        visibility = decode_maps(bits, track, before.visibility)
    after = decode_probes(bits, track, before)
    bits.finish()
    return Content(after, visibility)


def decode_probes(bits: Bits, track: Volume, before: Content) -> dict[int, Probe]:
    """[B-040]"""
    decoding = Decoding(bits, track, before)
    for index in range(track.probes):
        decoding.decode_probe(index)
    return {index: probe for index, probe in enumerate(decoding.after) if probe.level > 0}


class Decoding:
    """A section while its probes are decoded, in ascending order of index."""

    def __init__(self, bits: Bits, track: Volume, before: Content) -> None:
        self.bits = bits
        self.track = track
        self.before = before
        # Of the probes so far:
        self.after: list[Probe] = []
        self.changed: list[bool] = []
        self.residuals: list[tuple[int, ...]] = []

    def decode_probe(self, index: int) -> None:
        base = self.before.probe(index)
        neighbours = lower_neighbours(self.track, index)
        c = sum(self.changed[q] for q in neighbours)
        changed = bool(self.bits.bit(CHANGED(base.level == 0, c)))
        probe, residuals = base, NO_CODES
        if changed:
            probe, residuals = self.decode_change(base, neighbours)
        self.after.append(probe)
        self.changed.append(changed)
        self.residuals.append(residuals)

    def decode_change(self, base: Probe, neighbours: list[int]) -> tuple[Probe, tuple[int, ...]]:
        """A probe that changes: what it becomes, and its residuals."""
        bit = self.bits.bit
        level = self.decode_level(base.level)
        codes = [0] * 27
        residuals = [0] * 27
        near = [self.residuals[q] for q in neighbours]

        any_residual = 0
        for g in range(2 * level):
            group = GROUPS[g]
            intra = int(g >= 2 * base.level)
            for i in group:
                codes[i] = self.predict(i, g // 2, neighbours) if intra else base.codes[i]
            c = sum(any(r[i] for i in group) for r in near)
            any_residual = bit(ANY(intra, g, c, any_residual))
            if not any_residual:
                continue
            for i in group:
                c = sum(r[i] != 0 for r in near)
                if i == group[-1] and not any(residuals[j] for j in group):
                    some = 1  # there is one, and this is the last chance
                else:
                    some = bit(SOME(intra, g, c))
                if some:
                    residuals[i] = self.decode_residual(intra, g, [r[i] for r in near])
                    codes[i] += residuals[i]
                    self.check_code(i, g, codes[i])
        return Probe(level, tuple(codes)), tuple(residuals)

    def decode_level(self, base_level: int) -> int:
        bit = self.bits.bit
        if base_level > 0 and not bit(OTHER()):
            return base_level
        others = [level for level in (3, 2, 1, 0) if level != base_level]
        if not bit(LEVEL(base_level, 0)):
            return others[0]
        if not bit(LEVEL(base_level, 1)):
            return others[1]
        return others[2]

    def predict(self, i: int, degree: int, neighbours: list[int]) -> int:
        """[B-041]: a code of an intra group."""
        codes = [self.after[q].codes[i] for q in neighbours if self.after[q].level > degree]
        return sum(codes) // len(codes) if codes else 0  # // is the floor

    def decode_residual(self, intra: int, g: int, near: list[int]) -> int:
        """One that is not 0; `near` are the neighbours' residuals of the same code."""
        bit = self.bits.bit
        s = sum(r > 0 for r in near) - sum(r < 0 for r in near)
        a = bit(AGAINST(intra, g % 2, min(abs(s), 2)))
        negative = (a == 1) != (s < 0)
        e = 0
        while e < 15 and bit(LONGER(intra, g, min(e, 5))):
            e += 1
        m = 1
        for k in range(e):
            m = 2 * m + (bit(SECOND(intra, g)) if k == 0 else self.bits.even())
        return -m if negative else m

    def check_code(self, i: int, g: int, code: int) -> None:
        """[B-042]"""
        scaled = code * self.track.steps[g]
        in_range = 0 <= scaled <= 10239 if i == 0 else -32768 <= scaled <= 32768
        if not in_range or not -32768 <= code <= 32767:
            raise Fault(3104)


# ---- Coding `packed`: visibility maps (section 9.2) ----


def decode_maps(bits: Bits, track: Volume, before: bytes | None) -> bytes:
    """The visibility block after the frame; `before` is the committed one. [B-063]"""
    intra = int(before is None)
    size = 2 * track.side**2
    priors = bytes((255, 0)) * (track.probes * size // 2) if before is None else before
    maps: list[bytes] = []
    changes: list[bool] = []
    for index in range(track.probes):
        near = near_maps(track, index)
        changed = sum(changes[q] for q in near if q is not None)
        prior = priors[index * size : (index + 1) * size]
        changes.append(bool(bits.bit(MAP_CHANGED(intra, changed))))
        if changes[-1]:
            around = [None if q is None else maps[q] for q in near]
            prior = decode_map(bits, track, around, prior)
        maps.append(prior)
    return b"".join(maps)


def near_maps(track: Volume, index: int) -> list[int | None]:
    """The neighbours at x - 1, y - 1, z - 1, with those that do not exist."""
    at = place(track, index)
    return [index - step if at[k] > 0 else None for k, step in enumerate(strides(track))]


def decode_map(bits: Bits, track: Volume, around: list[bytes | None], prior: bytes) -> bytes:
    planes = [MapPlane(bits, track, around, prior, k) for k in (0, 1)]
    deviates = bits.bit(MAP_DEVIATES())
    texels = bytearray()
    for texel in range(track.side**2):
        residual = planes[0].decode(texel, None)
        deviation = 0
        if deviates:
            planes[1].decode(texel, abs(residual))
            deviation = planes[1].byte(texel)
        texels += bytes((planes[0].byte(texel), deviation))
    return bytes(texels)


class MapPlane:
    """The means (k = 0) or the deviations (k = 1) of a map while they are decoded."""

    def __init__(
        self, bits: Bits, track: Volume, around: list[bytes | None], prior: bytes, k: int
    ) -> None:
        self.bits = bits
        self.k = k
        self.side = track.side
        self.step = track.map_steps[k]
        self.largest = self.code_of(255)
        self.around = [None if each is None else each[k::2] for each in around]
        self.prior = prior[k::2]
        # Of the texels so far:
        self.codes: list[int] = []
        self.residuals: list[int] = []
        self.errors: list[list[int]] = []

    def code_of(self, byte: int) -> int:
        return -(-byte // self.step)

    def byte(self, texel: int) -> int:
        """[B-064]"""
        return min(self.codes[texel] * self.step, 255)

    def before(self, texel: int) -> tuple[int | None, int | None, int | None, int | None]:
        """The texels to the left, above, above to the left, above to the right."""
        row, column = divmod(texel, self.side)
        left, right = column > 0, column < self.side - 1
        return (
            texel - 1 if left else None,
            texel - self.side if row else None,
            texel - self.side - 1 if row and left else None,
            texel - self.side + 1 if row and right else None,
        )

    def own_candidate(self, texel: int, prior: int) -> int:
        w, n, nw, _ = (None if at is None else self.codes[at] for at in self.before(texel))
        if w is None:
            return prior if n is None else n
        if n is None or nw is None:
            return w
        return sorted((w, n, w + n - nw))[1]

    def decode(self, texel: int, spread: int | None) -> int:
        """A code; returns its residual. `spread` is known for deviations."""
        bit, k = self.bits.bit, self.k
        candidates = [None if each is None else self.code_of(each[texel]) for each in self.around]
        prior = self.code_of(self.prior[texel])
        candidates += [self.own_candidate(texel, prior), prior]
        before = self.before(texel)
        best_error, best = None, prior
        for which, candidate in enumerate(candidates):
            if candidate is None:
                continue
            weights = zip((2, 2, 1, 1), before)
            error = sum(w * self.errors[at][which] for w, at in weights if at is not None)
            if best_error is None or error < best_error:
                best_error, best = error, candidate
        assert best_error is not None
        cls = min(7, best_error.bit_length())
        beside = sum(self.residuals[at] != 0 for at in before[:2] if at is not None)
        if spread is None:
            spread = max((abs(c - best) for c in candidates[:3] if c is not None), default=0)
        residual = 0
        if bit(MAP_SIGNIFICANT(k, cls, beside, min(3, (spread.bit_length() + 1) // 2))):
            negative = best == self.largest
            if 0 < best < self.largest:
                own = candidates[3] - best
                negative = bool(bit(MAP_SIGN(k, cls, 1 + (own > 0) - (own < 0))))
            elif best == 0:
                negative = False
            residual = self.decode_magnitude(cls) * (-1 if negative else 1)
        code = best + residual
        if not 0 <= code <= self.largest:  # [B-066]
            raise Fault(3104)
        self.codes.append(code)
        self.residuals.append(residual)
        self.errors.append([0 if c is None else abs(code - c) for c in candidates])
        return residual

    def decode_magnitude(self, cls: int) -> int:
        bit, k = self.bits.bit, self.k
        e = 0
        while e < 7 and bit(MAP_PREFIX(k, cls, e)):
            e += 1
        m = 1
        for i in range(e):
            m = 2 * m + (bit(MAP_SUFFIX(k, e - 1)) if i == 0 else self.bits.even())
        return m


def place(track: Volume, index: int) -> tuple[int, int, int]:
    """The place of a probe (section 1)."""
    dx, dy, _ = track.dims
    return index % dx, index // dx % dy, index // (dx * dy)


def strides(track: Volume) -> tuple[int, int, int]:
    """What a step along each axis adds to an index."""
    dx, dy, _ = track.dims
    return 1, dx, dx * dy


def lower_neighbours(track: Volume, index: int) -> list[int]:
    """Those at x - 1, y - 1, z - 1."""
    return [index - stride for at, stride in zip(place(track, index), strides(track)) if at > 0]


def all_neighbours(track: Volume, index: int) -> list[int]:
    """Those one step away, up to six."""
    above = [
        index + stride
        for at, size, stride in zip(place(track, index), track.dims, strides(track))
        if at < size - 1
    ]
    return lower_neighbours(track, index) + above


# ---- Values (section 7), in units of 2^-24 ----

# [B-050]: 2^(15 + i / 256), rounded. Eight square roots of 2^(256 * 16 + i) are the floor of twice that.


def _power(i: int) -> int:
    twice = 1 << (256 * 16 + i)
    for _ in range(8):
        twice = isqrt(twice)
    return (twice + 1) >> 1


POWERS = tuple(_power(i) for i in range(256))

F16_LARGEST = 65504 << 24


def f16_from_units(value: int) -> int:
    """[B-053]: the bits of the nearest f16, ties to even."""
    sign = 0x8000 if value < 0 else 0
    magnitude = min(abs(value), F16_LARGEST)
    shift = max(0, magnitude.bit_length() - 11)  # 11 bits stay; a subnormal has fewer
    kept, rest = magnitude >> shift, magnitude & ((1 << shift) - 1)
    half = (1 << shift) >> 1
    if rest > half or (rest == half and shift and kept & 1):
        kept += 1  # perhaps to 2^11: then the exponent below goes up by the carry
    return sign | (shift << 10) + kept


def units_from_f16(bits: int) -> int:
    exponent, mantissa = bits >> 10 & 31, bits & 1023
    magnitude = (1024 + mantissa) << (exponent - 1) if exponent else mantissa
    return -magnitude if bits >> 15 else magnitude


def probe_values(track: Volume, probe: Probe) -> tuple[int, ...]:
    """The 27 f16 of a probe that is present, as their bits."""
    if track.coding == RAW:
        return probe.codes
    codes, steps = probe.codes, track.steps
    e = codes[0] * steps[0]
    luma = (POWERS[e % 256] << e // 256) >> 15 if e else 0  # [B-050]
    ys = [luma] + [luma * codes[i] * steps[g] >> 12 for g in (2, 4) for i in GROUPS[g]]  # [B-051]
    chroma = [luma * codes[i] * steps[g] >> 12 for g in (1, 3, 5) for i in GROUPS[g]]
    values = []
    for lm, y in enumerate(ys):  # [B-052]
        co, cg = chroma[2 * lm], chroma[2 * lm + 1]
        for value in (y + co - cg, y + cg, y - co - cg):
            values.append(f16_from_units(max(value, 0) if lm == 0 else value))
    return tuple(values)


def all_values(track: Volume, content: Content) -> list[tuple[int, ...]]:
    """The values of every probe: the present ones, and absent ones within reach filled (section 8)."""
    values: list[tuple[int, ...] | None] = [None] * track.probes
    for index, probe in content.probes.items():
        values[index] = probe_values(track, probe)

    latest = sorted(content.probes)  # the probes of distance d - 1
    for _ in range(REACH):  # [B-060], one distance after the other
        filled: dict[int, list[int]] = {}  # the probes of distance d, with those that they are near to
        for index in latest:
            for neighbour in all_neighbours(track, index):
                if values[neighbour] is None:
                    filled.setdefault(neighbour, []).append(index)
        for index, near in filled.items():
            columns = zip(*([units_from_f16(bits) for bits in values[q]] for q in near))
            values[index] = tuple(f16_from_units(sum(column) // len(near)) for column in columns)
        latest = list(filled)
    return [NO_CODES if value is None else value for value in values]
