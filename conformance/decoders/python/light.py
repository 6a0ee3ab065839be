"""Sampling of probes in floating point (probes.md, section 12)."""

import math

from probes import Content, all_values, units_from_f16
from sampling import Vector, as_float, dot, normalised
from tracks import Volume

INTERPOLATIONS = TRILINEAR, VISIBILITY_WEIGHTED = "trilinear", "visibility-weighted"

WRAP = 0.2
NORMAL_BIAS = 0.045
VIEW_BIAS = 0.18
CRUSH = 0.2
UNSEEN = 0.000001
ABSENT = 0.000000000001

# The degree of each lm.
DEGREES = (0, 1, 1, 1, 2, 2, 2, 2, 2)

# [B-077]: what the cosine of a surface leaves of each degree.
COSINE = (math.pi, 2 * math.pi / 3, math.pi / 4)


class Light:
    """The probes of a track, ready for queries."""

    def __init__(self, track: Volume, content: Content) -> None:
        self.track = track
        self.content = content
        self.spacing: Vector = tuple(as_float(bits) for bits in track.spacing)
        self.range = as_float(track.range)
        self.values = all_values(track, content)

    def ask(
        self, x: Vector, normal: Vector, view: Vector, roughness: float, interpolation: str
    ) -> tuple[list[float], list[float]]:
        """Irradiance and filtered radiance: red, green and blue of each.

        x, the unit normal and the unit direction to the viewer are in grid space.
        """
        coefficients = self.mean(self.weights(x, normal, view, interpolation))
        irradiance = project(coefficients, COSINE, normal)
        about = lobe_direction(normal, view, roughness)
        factors = (1.0, 4 / 5 - 2 * roughness / 15, 1 / 2 - roughness / 4)  # [B-078]
        return irradiance, project(coefficients, factors, about)

    # ---- Interpolation (sections 12.1 and 12.2) ----

    def weights(
        self, x: Vector, normal: Vector, view: Vector, interpolation: str
    ) -> list[tuple[int, float]]:
        """The indices of the corners, each with its weight."""
        corners = self.corners(x)
        if interpolation == TRILINEAR:  # [B-071]
            return [(self.index(corner), t) for corner, t in corners]
        weights = []
        for corner, t in corners:  # [B-072]
            way = minus(self.position(corner), x)
            distance = length(way)
            cosine = dot(normal, way) / distance if distance > 0 else 1.0
            wrapped = ((1 + cosine) / 2) ** 2 + WRAP
            weights.append((self.index(corner), t * wrapped * self.trust(corner, x, normal, view)))
        return weights

    def corners(self, x: Vector) -> list[tuple[tuple[int, int, int], float]]:
        """[B-070]: the places of the eight probes, each with its trilinear weight."""
        axes = []
        for place, spacing, size in zip(x, self.spacing, self.track.dims):
            at = min(max(place / spacing, 0), size - 1)
            base = min(math.floor(at), max(size - 2, 0))
            f = at - base
            axes.append(((base, 1 - f), (min(base + 1, size - 1), f)))
        return [
            ((px, py, pz), tx * ty * tz)
            for pz, tz in axes[2]
            for py, ty in axes[1]
            for px, tx in axes[0]
        ]

    def mean(self, weights: list[tuple[int, float]]) -> list[Vector]:
        """The 9 coefficients of red, green and blue each."""
        total = sum(weight for _, weight in weights)
        sums = [0.0] * 27
        for index, weight in weights:
            for v, bits in enumerate(self.values[index]):
                sums[v] += weight * units_from_f16(bits)
        scale = 2.0 ** (self.track.exponent - 24) / total
        return [tuple(scale * sums[3 * lm + channel] for channel in range(3)) for lm in range(9)]

    def index(self, place: tuple[int, int, int]) -> int:
        dx, dy, _ = self.track.dims
        x, y, z = place
        return x + dx * (y + dy * z)

    def position(self, place: tuple[int, int, int]) -> Vector:
        return tuple(at * spacing for at, spacing in zip(place, self.spacing))

    def trust(
        self, corner: tuple[int, int, int], x: Vector, normal: Vector, view: Vector
    ) -> float:
        """[B-073]"""
        index = self.index(corner)
        if index not in self.content.probes:
            return ABSENT
        if self.content.visibility is None:
            return 1.0
        lift = min(self.spacing)
        place = self.position(corner)
        q: Vector = tuple(
            x[axis] + (NORMAL_BIAS * normal[axis] + VIEW_BIAS * view[axis]) * lift - place[axis]
            for axis in range(3)
        )
        return max(self.share(index, q), UNSEEN)

    # ---- Visibility (section 12.3) ----

    def share(self, index: int, q: Vector) -> float:
        """[B-076]: how much of a place at q, from the probe, the probe sees."""
        distance = length(q)
        if distance == 0:  # q has no direction; no M is below 0
            return 1.0
        m, m2 = self.moments(index, q)
        if distance <= m or m >= self.range - self.range / 510:
            return 1.0
        variance = max(m2 - m**2, (self.range / 255) ** 2)
        b = variance / (variance + (distance - m) ** 2)
        return b**3 * min(b**3 / CRUSH, 1) ** 2

    def moments(self, index: int, q: Vector) -> tuple[float, float]:
        """[B-074]: M and M2 of a probe in the direction of q."""
        n = self.track.side
        u, v = octahedral_coordinates(q)
        i = (u + 1) * n / 2 - 0.5
        j = (v + 1) * n / 2 - 0.5
        column, row = math.floor(i), math.floor(j)
        fi, fj = i - column, j - row
        m = m2 = 0.0
        for at_row, t_row in ((row, 1 - fj), (row + 1, fj)):
            for at_column, t_column in ((column, 1 - fi), (column + 1, fi)):
                mean, deviation = self.texel(index, at_column, at_row)
                m += t_row * t_column * mean
                m2 += t_row * t_column * (mean**2 + deviation**2)
        return m, m2

    def texel(self, index: int, column: int, row: int) -> tuple[float, float]:
        """The mean and the deviation of a texel, in metres, of one beyond the edge too."""
        n = self.track.side
        if not 0 <= column < n:  # [B-075]
            column, row = min(max(column, 0), n - 1), n - 1 - row
        if not 0 <= row < n:
            column, row = n - 1 - column, min(max(row, 0), n - 1)
        at = 2 * (index * n * n + row * n + column)
        mean, deviation = self.content.visibility[at : at + 2]
        return mean * self.range / 255, deviation * self.range / 255


def octahedral_coordinates(q: Vector) -> tuple[float, float]:
    """[B-074]: of a direction, which need not have the length 1."""
    total = abs(q[0]) + abs(q[1]) + abs(q[2])
    x, y = q[0] / total, q[1] / total
    if q[2] < 0:
        return (1 - abs(y)) * sign(x), (1 - abs(x)) * sign(y)
    return x, y


def sign(t: float) -> int:
    return -1 if t < 0 else 1


def minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def length(v: Vector) -> float:
    return math.sqrt(dot(v, v))


# ---- What light comes (sections 2, 12.4 and 12.5) ----


def basis(direction: Vector) -> tuple[float, ...]:
    """The nine functions of a unit direction."""
    x, y, z = direction
    a = math.sqrt(3 / (4 * math.pi))
    b = math.sqrt(15 / (4 * math.pi))
    return (
        math.sqrt(1 / (4 * math.pi)),
        a * y,
        a * z,
        a * x,
        b * x * y,
        b * y * z,
        math.sqrt(5 / (16 * math.pi)) * (3 * z**2 - 1),
        b * x * z,
        math.sqrt(15 / (16 * math.pi)) * (x**2 - y**2),
    )


def project(
    coefficients: list[Vector], factors: tuple[float, float, float], direction: Vector
) -> list[float]:
    """[B-077], [B-078]: red, green and blue, with a factor for each degree."""
    functions = basis(direction)
    return [
        max(0.0, sum(factors[DEGREES[lm]] * coefficients[lm][c] * functions[lm] for lm in range(9)))
        for c in range(3)
    ]


def lobe_direction(normal: Vector, view: Vector, roughness: float) -> Vector:
    """[B-079]: h, between the mirror direction and the normal."""
    a = roughness**2
    g = (1 - a) * (math.sqrt(1 - a) + a)
    facing = 2 * dot(normal, view)
    return normalised(
        tuple(
            normal[axis] + (facing * normal[axis] - view[axis] - normal[axis]) * g
            for axis in range(3)
        )
    )
