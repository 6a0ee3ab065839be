"""Declarations of tracks (container.md, section 6.3; their parameters: points.md 2, probes.md 3, obscurance.md 3,
vertices.md 3, instances.md 3, regions.md 3)."""

from dataclasses import dataclass, fields
from typing import ClassVar

from errors import Fault
from limits import Limits
from payload import Fields, as_number

POINTS, PROBES, VERTICES, INSTANCES, REGIONS = 1, 2, 3, 4, 5  # models
CELLS = 0  # the coding of `points`
RAW, PACKED = 0, 1  # the codings of `probes` and of baked models
CODINGS = {
    POINTS: (CELLS,),
    PROBES: (RAW, PACKED),
    VERTICES: (RAW, PACKED),
    INSTANCES: (RAW, PACKED),
    REGIONS: (RAW, PACKED),
}


@dataclass(frozen=True)
class Declaration:
    """What a track's entry says of any model. Every f32 is kept as its bits."""

    model: ClassVar[int]
    f32s: ClassVar[set[str]] = {"aabb"}  # the fields that hold f32

    track_id: int
    coding: int
    space: int  # 0 mesh space as drawn, 1 rest pose
    application: int
    has_hash: bool
    content_hash: int
    path: str
    aabb: tuple[int, ...]  # minimum, then maximum

    def same_as(self, other: "Declaration") -> bool:
        """[C-075]: all fields, where -0 and +0 are one number."""
        return self._comparable() == other._comparable()

    def _comparable(self) -> tuple:
        values: list = [self.model]
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in self.f32s:
                several = value if isinstance(value, tuple) else (value,)
                value = tuple(as_number(bits) for bits in several)
            values.append(value)
        return tuple(values)


@dataclass(frozen=True)
class Gridded(Declaration):
    """A track of a model that has a grid space."""

    f32s = Declaration.f32s | {"grid_from_mesh"}

    grid_from_mesh: tuple[int, ...]
    dims: tuple[int, int, int]


@dataclass(frozen=True)
class Grid(Gridded):
    """A track of `points` (points.md, section 2)."""

    model = POINTS
    f32s = Gridded.f32s | {"edge", "radius"}

    edge: int
    radius: int
    position_bits: int
    normal_bits: int
    ao_bits: int
    bucket_count: int
    cell_capacity: int

    @property
    def cubes(self) -> int:
        return self.dims[0] * self.dims[1] * self.dims[2]

    @property
    def point_bits(self) -> int:
        return 1 + 3 * self.position_bits + 2 * self.normal_bits + self.ao_bits

    @property
    def state_bytes(self) -> int:
        """What the track counts against the limit of decoded state (points.md, section 2)."""
        return 32 * self.bucket_count + 36 * self.cell_capacity


@dataclass(frozen=True)
class Volume(Gridded):
    """A track of `probes` (probes.md, section 3)."""

    model = PROBES
    f32s = Gridded.f32s | {"spacing", "range"}

    spacing: tuple[int, int, int]
    exponent: int
    side: int  # of a visibility map; 0 without visibility
    range: int  # of visibility
    steps: tuple[int, ...]  # six, one a group of codes; 0 in the coding `raw`
    map_steps: tuple[int, int] = (0, 0)  # of means and deviations; 0 in `raw` and without visibility

    @property
    def probes(self) -> int:
        return self.dims[0] * self.dims[1] * self.dims[2]

    @property
    def visibility_bytes(self) -> int:
        """The size of a visibility block."""
        return 2 * self.side**2 * self.probes

    @property
    def state_bytes(self) -> int:
        """[B-006]: what the track counts against the limit of decoded state."""
        copies = 2 if self.coding == PACKED else 1
        return self.probes * 184 + copies * self.visibility_bytes


@dataclass(frozen=True)
class Baked(Declaration):
    """A track of a baked model: its signals block (obscurance.md, section 3)."""

    f32s = Declaration.f32s | {"distances", "share"}

    signals: int
    kinds: tuple[int, int]  # of kernels A and B
    distances: tuple[int, int]
    share: int


@dataclass(frozen=True)
class VertexSet(Baked):
    """A track of `vertices` (vertices.md, section 3)."""

    model = VERTICES

    count: int
    bits: int  # of a code
    order: int  # 0 that of the file, 1 distinct vertices

    @property
    def values(self) -> int:
        return self.count * self.signals

    @property
    def array_bytes(self) -> int:
        """The values, rounded up to a multiple of 4."""
        return (self.values + 3) // 4 * 4

    @property
    def state_bytes(self) -> int:
        """[V-002]: what the track counts against the limit of decoded state."""
        return 2 * self.array_bytes


@dataclass(frozen=True)
class Table(Baked):
    """A track of `instances` (instances.md, section 3)."""

    model = INSTANCES

    count: int
    exponent: int
    step: int

    @property
    def state_bytes(self) -> int:
        """[I-002]: what the track counts against the limit of decoded state."""
        return self.count * (16 + 16 * self.signals)


@dataclass(frozen=True)
class RegionSet(Baked):
    """A track of `regions` (regions.md, section 3)."""

    model = REGIONS

    count: int
    capacity: int  # pairs of coefficients
    exponent: int
    step: int

    @property
    def state_bytes(self) -> int:
        """[R-004]: what the track counts against the limit of decoded state."""
        return 96 * self.count + 8 * self.capacity


def read_entry(payload: Fields, limits: Limits) -> Declaration:
    """One entry of a `track` record: steps 1 to 4 of the order of checks."""
    # 1. The size.
    start = payload.at
    size = payload.u32()
    if size < 12 or size % 4 or size > payload.end - start:
        raise Fault(2001)
    entry = Fields(payload.data, payload.at, start + size)
    payload.at = start + size

    # 2. The fields in the order of their offsets, each checked as soon as it is read.
    track_id = entry.u32()
    model = entry.u16()
    if model not in CODINGS:  # [C-071]
        raise Fault(2007)
    coding = entry.u16()
    if coding not in CODINGS[model]:
        raise Fault(2008)
    space = entry.u8()
    if space > (1 if model == POINTS else 0):
        raise Fault(2020)
    has_hash = entry.u8()
    path_length = entry.u16()
    application = entry.u64()
    content_hash = entry.u64()
    if has_hash > 1 or (has_hash == 0 and content_hash != 0):  # here, not at offset 13
        raise Fault(2002)
    aabb = entry.f32s(6)
    if model == POINTS:
        parameters = read_grid(entry)
    elif model == PROBES:
        parameters = read_volume(entry, coding)
    elif model == VERTICES:
        parameters = read_vertex_set(entry)
    elif model == INSTANCES:
        parameters = read_table(entry)
    else:
        parameters = read_region_set(entry)

    # 3. The path, then the padding.
    if path_length > limits.path_bytes:
        raise Fault(2012)
    try:
        path = entry.bytes(path_length).decode("utf-8")  # strict: as RFC 3629 [C-072]
    except UnicodeDecodeError:
        raise Fault(2011) from None
    if entry.left() > 3:
        raise Fault(2001)
    entry.zero(entry.left())

    # 4. The AABB, then the parameters of the model.
    for axis in range(3):  # [C-073]
        if as_number(aabb[axis]) > as_number(aabb[axis + 3]):
            raise Fault(2010)
    common = (
        track_id, coding, space, application, bool(has_hash), content_hash, path, aabb,
    )
    if model == POINTS:
        grid = Grid(*common, **parameters)
        check_grid(grid)
        return grid
    if model == PROBES:
        volume = Volume(*common, **parameters)
        check_volume(volume)
        return volume
    if model == VERTICES:
        vertices = VertexSet(*common, **parameters)
        check_signals(vertices)
        check_vertex_set(vertices)
        return vertices
    if model == REGIONS:
        regions = RegionSet(*common, **parameters)
        check_signals(regions)
        check_region_set(regions)
        return regions
    table = Table(*common, **parameters)
    check_signals(table)
    check_table(table)
    return table


def read_grid_space(entry: Fields) -> dict:
    """What the parameters of `points` and `probes` begin with."""
    grid_from_mesh = entry.f32s(12)
    dims = (entry.u16(), entry.u16(), entry.u16())
    entry.zero(2)
    return dict(grid_from_mesh=grid_from_mesh, dims=dims)


# ---- points.md, section 2 ----


def read_grid(entry: Fields) -> dict:
    """The parameters of `points`."""
    space = read_grid_space(entry)
    edge, radius = entry.f32s(2)
    position_bits, normal_bits, ao_bits = entry.u8(), entry.u8(), entry.u8()
    entry.zero(1)
    return space | dict(
        edge=edge, radius=radius,
        position_bits=position_bits, normal_bits=normal_bits, ao_bits=ao_bits,
        bucket_count=entry.u32(), cell_capacity=entry.u32(),
    )


def check_grid(track: Grid) -> None:
    """[P-001] to [P-004]."""
    if not 1 <= track.cubes <= 2**32 - 1:
        raise Fault(2014)
    if not radius_fits(track.radius, track.edge):
        raise Fault(2015)
    widths_in_range = (
        1 <= track.position_bits <= 8 and 2 <= track.normal_bits <= 8 and 1 <= track.ao_bits <= 8
    )
    if not widths_in_range or track.point_bits not in (16, 24, 32):
        raise Fault(2016)
    if track.bucket_count < 1 or not 1 <= track.cell_capacity <= 2**32 - 2:
        raise Fault(2017)


def radius_fits(radius: int, edge: int) -> bool:
    """[P-002] on bits: twice the radius is at most the next f32 above the edge."""
    if not (1 <= radius <= 0x7F7FFFFF and 1 <= edge <= 0x7F7FFFFF):
        return False
    twice = radius + 0x00800000 if radius >= 0x00800000 else 2 * radius
    return min(twice, 0x7F800000) <= edge + 1


# ---- probes.md, section 3 ----


def read_volume(entry: Fields, coding: int) -> dict:
    """The parameters of `probes`."""
    space = read_grid_space(entry)
    spacing = entry.f32s(3)
    exponent = entry.u8()
    side = entry.u8()
    map_steps = (entry.u8(), entry.u8())
    visibility_range = entry.f32()
    steps = tuple(entry.u16() for _ in range(6))
    if coding == RAW and any(steps):  # [C-041], once the last of them is read
        raise Fault(2002)
    return space | dict(
        spacing=spacing, exponent=exponent - 256 if exponent >= 128 else exponent,
        side=side, range=visibility_range, steps=steps, map_steps=map_steps,
    )


def check_volume(track: Volume) -> None:
    """[B-001] to [B-005]."""
    if not 1 <= track.probes <= 2**24:
        raise Fault(2022)
    if any(as_number(bits) <= 0 for bits in track.spacing):
        raise Fault(2023)
    if not -64 <= track.exponent <= 64:
        raise Fault(2024)
    if track.side == 0:
        range_fits = track.range == 0  # in all bits
    else:
        range_fits = as_number(track.range) > 0
    if track.side and track.coding == PACKED:
        map_steps_fit = 0 not in track.map_steps
    else:
        map_steps_fit = track.map_steps == (0, 0)
    if track.side not in (0, 4, 8, 16) or not range_fits or not map_steps_fit:
        raise Fault(2025)
    if track.coding == PACKED:
        first, *others = track.steps
        if not 1 <= first <= 2560 or not all(1 <= step <= 32768 for step in others):
            raise Fault(2026)


# ---- obscurance.md, section 3 ----


def read_signals(entry: Fields) -> dict:
    """The signals block."""
    signals, kinds = entry.u8(), (entry.u8(), entry.u8())
    entry.zero(1)
    distances = (entry.f32(), entry.f32())
    return dict(signals=signals, kinds=kinds, distances=distances, share=entry.f32())


def check_signals(track: Baked) -> None:
    """[O-001] to [O-003], all error 2028."""
    a, b = track.kinds
    if track.signals not in (1, 2) or (track.signals == 2 and b == 0):
        raise Fault(2028)
    if a not in (1, 2) or b not in (0, 1, 2):
        raise Fault(2028)
    distance_a, distance_b = track.distances
    if as_number(distance_a) <= 0:
        raise Fault(2028)
    if distance_b != 0 if b == 0 else as_number(distance_b) <= 0:
        raise Fault(2028)
    if b == 0:
        share_fits = track.share == 0  # in all bits
    else:
        share_fits = 0 <= as_number(track.share) <= 0x3F800000  # 1.0
    if not share_fits:
        raise Fault(2028)


# ---- instances.md, section 3 ----


def read_table(entry: Fields) -> dict:
    """The parameters of `instances`."""
    signals = read_signals(entry)
    count, exponent = entry.u32(), entry.u8()
    entry.zero(1)
    return signals | dict(count=count, exponent=exponent, step=entry.u16())


def check_table(track: Table) -> None:
    """[I-001]"""
    if not (1 <= track.count <= 2**24 and track.exponent <= 3 and 1 <= track.step <= 32767):
        raise Fault(2030)


# ---- regions.md, section 3 ----


def read_region_set(entry: Fields) -> dict:
    """The parameters of `regions`."""
    signals = read_signals(entry)
    count, capacity = entry.u32(), entry.u32()
    exponent = entry.u8()
    entry.zero(1)
    return signals | dict(count=count, capacity=capacity, exponent=exponent, step=entry.u16())


def check_region_set(track: RegionSet) -> None:
    """[R-001] to [R-003]."""
    if not 1 <= track.count <= 2**20:
        raise Fault(2031)
    if not track.count <= track.capacity <= 63 * track.count:
        raise Fault(2031)
    if track.exponent > 3 or not 1 <= track.step <= 32767:
        raise Fault(2031)


# ---- vertices.md, section 3 ----


def read_vertex_set(entry: Fields) -> dict:
    """The parameters of `vertices`."""
    signals = read_signals(entry)
    count, bits, order = entry.u32(), entry.u8(), entry.u8()
    entry.zero(2)
    return signals | dict(count=count, bits=bits, order=order)


def check_vertex_set(track: VertexSet) -> None:
    """[V-001]"""
    if not 1 <= track.count <= 2**28 or track.bits not in (8, 5) or track.order not in (0, 1):
        raise Fault(2029)
