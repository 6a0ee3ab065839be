"""Sampling in floating point (points.md, section 8)."""

import math
import struct

from points import Content, cube_hash
from tracks import Grid

Vector = tuple[float, float, float]

T_N = 0.1
T_D = 0.7


def as_float(bits: int) -> float:
    """The f32 with these bits."""
    return struct.unpack("<f", struct.pack("<I", bits))[0]


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def normalised(v: Vector) -> Vector:
    length = math.sqrt(dot(v, v))
    if length == 0:
        return v
    return (v[0] / length, v[1] / length, v[2] / length)


# ---- Values of a point ----


class Point:
    """The values of a stored point in the cube (x, y, z): [P-040] to [P-042]."""

    def __init__(self, track: Grid, cube: tuple[int, int, int], bits: int) -> None:
        p, n, a = track.position_bits, track.normal_bits, track.ao_bits

        def take(width: int) -> int:
            nonlocal bits
            value = bits % 2**width
            bits >>= width
            return value

        ao = take(a)
        u = take(n)
        v = take(n)
        place = (take(p), take(p), take(p))
        edge = as_float(track.edge)
        self.ao = ao / (2**a - 1)
        self.normal = octahedral(signed(u, n), signed(v, n), n)
        self.position: Vector = tuple(
            (cube[axis] + (place[axis] + 0.5) / 2**p) * edge for axis in range(3)
        )


def signed(value: int, width: int) -> int:
    """A number in two's complement."""
    return value - 2**width if value >= 2 ** (width - 1) else value


def octahedral(u_code: int, v_code: int, width: int) -> Vector:
    """[P-042]: the normal of two signed codes."""
    steps = 2 ** (width - 1) - 1
    u = max(u_code / steps, -1.0)
    v = max(v_code / steps, -1.0)
    z = 1 - abs(u) - abs(v)
    if z < 0:
        sign_u = -1 if u < 0 else 1
        sign_v = -1 if v < 0 else 1
        u, v = (1 - abs(v)) * sign_u, (1 - abs(u)) * sign_v
    return normalised((u, v, z))


# ---- Occlusion at a fragment ----


def ambient_occlusion(track: Grid, content: Content, x: Vector, normal: Vector) -> float:
    """The AO at x with a unit normal, both in grid space."""
    radius = as_float(track.radius)
    weights = 0.0
    total = 0.0
    for cube in cubes_around(track, x):
        for point in points_of(track, content, cube):
            alpha = weight(point, x, normal, radius)
            weights += alpha
            total += alpha * point.ao
    if weights == 0:  # [P-048]
        return 1.0
    return total / weights  # [P-047]


def cubes_around(track: Grid, x: Vector) -> list[tuple[int, int, int]]:
    """[P-043]: the cube of x and those on the nearer sides, as far as they are in the grid."""
    edge = as_float(track.edge)
    axes: list[list[int]] = []
    for axis in range(3):
        place = x[axis] / edge
        cube = math.floor(place)
        neighbour = cube - 1 if place - cube < 0.5 else cube + 1
        axes.append([c for c in (cube, neighbour) if 0 <= c < track.dims[axis]])
    return [(cx, cy, cz) for cx in axes[0] for cy in axes[1] for cz in axes[2]]


def points_of(track: Grid, content: Content, cube: tuple[int, int, int]) -> list[Point]:
    """[P-044]: the points of all cells with the cube's key that its bucket names."""
    x, y, z = cube
    cube_key = x + track.dims[0] * (y + track.dims[1] * z)
    found = []
    for entry in content.buckets.get(cube_hash(track, x, y, z), ()):
        key, points = content.cells[entry]
        if key == cube_key:
            found += [Point(track, cube, bits) for bits in points if bits]
    return found


def weight(point: Point, x: Vector, normal: Vector, radius: float) -> float:
    """[P-045], [P-046]: alpha of a point."""
    way: Vector = tuple(point.position[axis] - x[axis] for axis in range(3))
    distance = math.sqrt(dot(way, way))
    if dot(point.normal, normal) <= T_N:
        return 0.0
    if distance > 0 and (dot(point.normal, way) / distance) ** 2 >= T_D:
        return 0.0
    return max(0.0, (radius - distance) / radius)
