"""Declarations of tracks (container.md, section 6.3; parameters of a model: points.md, section 2)."""

from dataclasses import dataclass

from errors import Fault
from limits import Limits
from payload import Fields, as_number


@dataclass(frozen=True)
class Declaration:
    """What a track's entry says. Every f32 is kept as its bits."""

    track_id: int
    space: int  # 0 mesh space as drawn, 1 rest pose
    application: int
    has_hash: bool
    content_hash: int
    aabb: tuple[int, ...]  # minimum, then maximum
    grid_from_mesh: tuple[int, ...]
    dims: tuple[int, int, int]
    edge: int
    radius: int
    position_bits: int
    normal_bits: int
    ao_bits: int
    bucket_count: int
    cell_capacity: int
    path: str

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

    def same_as(self, other: "Declaration") -> bool:
        """[C-075]: all fields, where -0 and +0 are one number."""
        return self._comparable() == other._comparable()

    def _comparable(self) -> tuple:
        floats = self.aabb + self.grid_from_mesh + (self.edge, self.radius)
        rest = (
            self.track_id, self.space, self.application, self.has_hash, self.content_hash,
            self.dims, self.position_bits, self.normal_bits, self.ao_bits,
            self.bucket_count, self.cell_capacity, self.path,
        )
        return rest, tuple(as_number(bits) for bits in floats)


def read_entry(fields: Fields, limits: Limits) -> Declaration:
    """One entry of a `track` record: steps 1 to 4 of the order of checks."""
    # 1. The size.
    start = fields.at
    size = fields.u32()
    if size < 12 or size % 4 or size > fields.end - start:
        raise Fault(2001)
    entry = Fields(fields.data, fields.at, start + size)
    fields.at = start + size

    # 2. The fields in the order of their offsets, each checked as soon as it is read.
    track_id = entry.u32()
    if entry.u16() != 1:  # model [C-071]
        raise Fault(2007)
    if entry.u16() != 0:  # coding
        raise Fault(2008)
    space = entry.u8()
    if space > 1:
        raise Fault(2020)
    has_hash = entry.u8()
    path_length = entry.u16()
    application = entry.u64()
    content_hash = entry.u64()
    if has_hash > 1 or (has_hash == 0 and content_hash != 0):  # here, not at offset 13
        raise Fault(2002)
    aabb = entry.f32s(6)
    grid_from_mesh = entry.f32s(12)
    dims = (entry.u16(), entry.u16(), entry.u16())
    entry.zero(2)
    edge = entry.f32()
    radius = entry.f32()
    position_bits = entry.u8()
    normal_bits = entry.u8()
    ao_bits = entry.u8()
    entry.zero(1)
    bucket_count = entry.u32()
    cell_capacity = entry.u32()

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
    declaration = Declaration(
        track_id, space, application, bool(has_hash), content_hash, aabb, grid_from_mesh, dims,
        edge, radius, position_bits, normal_bits, ao_bits, bucket_count, cell_capacity, path,
    )
    check_parameters(declaration)
    return declaration


def check_parameters(track: Declaration) -> None:
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
