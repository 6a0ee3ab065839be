"""The canonical dump (dump.md)."""

import struct
from typing import BinaryIO

import instances
import points
import probes
import regions
import vertices
from digest import xxh64
from session import Track
from tracks import (
    CELLS, INSTANCES, PACKED, POINTS, PROBES, RAW, REGIONS, VERTICES,
    Declaration, Grid, RegionSet, Table, VertexSet, Volume,
)

NAMES = {
    (POINTS, CELLS): "points cells",
    (PROBES, RAW): "probes raw",
    (PROBES, PACKED): "probes packed",
    (VERTICES, RAW): "vertices raw",
    (VERTICES, PACKED): "vertices packed",
    (INSTANCES, RAW): "instances raw",
    (INSTANCES, PACKED): "instances packed",
    (REGIONS, RAW): "regions raw",
    (REGIONS, PACKED): "regions packed",
}


class Dump:
    """Writes the dump of a stream as the stream is decoded."""

    def __init__(self, out: BinaryIO) -> None:
        self.out = out
        self.line("dapple-dump 1")

    def line(self, text: str) -> None:
        self.out.write(text.encode("utf-8") + b"\n")

    # ---- what a decoder tells (session.Observer) ----

    def stream(self, ticks: int, seconds: int) -> None:
        self.line(f"stream {ticks} {seconds}")

    def group(self, group_id: int, digest: int | None) -> None:
        start = "keyframes" if digest is None else f"state {digest:016x}"
        self.line(f"group {group_id} {start}")

    def frame(self, number: int, tick: int, digest: int, tracks: list[Track]) -> None:
        self.line(f"frame {number} {tick} {digest:016x}")
        for track in tracks:
            self.track(track)

    def end(self) -> None:
        self.line("end")

    def skipped(self, record_type: int, sequence: int) -> None:
        pass  # no line

    # ---- the state of a frame ----

    def track(self, track: Track) -> None:
        said = track.declaration
        number = said.track_id
        self.line(declaration_line(said))
        if isinstance(said, Grid):
            self.line(grid_line(said))
        elif isinstance(said, Volume):
            self.line(volume_line(said))
        elif isinstance(said, VertexSet):
            self.line(vertex_set_line(said))
        elif isinstance(said, Table):
            self.line(table_line(said))
        else:
            self.line(region_set_line(said))
        if track.transform is not None:
            bits = [
                int.from_bytes(track.transform[at : at + 4], "little") for at in range(0, 48, 4)
            ]
            self.line(f"transform {number} {floats(bits)}")
        if isinstance(said, Grid):
            self.points(said, track.content)
        elif isinstance(said, Volume):
            self.probes(said, track.content)
        elif isinstance(said, VertexSet):
            self.vertices(said, track.content)
        elif isinstance(said, Table):
            self.instances(said, track.content)
        else:
            self.regions(said, track.content)

    def points(self, said: Grid, content: points.Content) -> None:
        digits = said.point_bits // 4
        for index in sorted(content.buckets):
            cells = []
            for entry in content.buckets[index]:
                key, points = content.cells[entry]
                there = ",".join(f"{point:0{digits}x}" for point in points if point)
                cells.append(f"{key}:{there}")
            self.line(f"bucket {said.track_id} {index} {' '.join(cells)}")

    def probes(self, said: Volume, content: probes.Content) -> None:
        number = said.track_id
        for index in sorted(content.probes):
            level, codes = content.probes[index]
            shown = ",".join(f"{code & 0xFFFF:04x}" for code in codes)
            self.line(f"probe {number} {index} {level} {shown}")
        values = b"".join(struct.pack("<27H", *each) for each in probes.all_values(said, content))
        self.line(f"values {number} {xxh64(values):016x}")
        if content.visibility is not None:
            self.line(f"visibility {number} {xxh64(content.visibility):016x}")

    def vertices(self, said: VertexSet, content: vertices.Content) -> None:
        values = content.values()
        for index in range(said.count):
            own = values[index * said.signals : (index + 1) * said.signals]
            if any(value < 255 for value in own):
                self.line(f"vertex {said.track_id} {index} {','.join(map(str, own))}")

    def instances(self, said: Table, content: instances.Content) -> None:
        for key, values in content.entries:
            shown = [",".join(f"{value & 0xFFFF:04x}" for value in signal) for signal in values]
            self.line(f"entry {said.track_id} {key:016x} {' '.join(shown)}")

    def regions(self, said: RegionSet, content: regions.Content) -> None:
        for index, region in enumerate(content.regions):
            form = ",".join(str(number) for number in region.form)
            centre = "- - -" if region.centre is None else floats(region.centre)
            shown = ",".join(f"{value & 0xFFFF:04x}" for value in region.values)
            self.line(f"region {said.track_id} {index} {form} {floats(region.box)} {centre} {shown}")


def declaration_line(said: Declaration) -> str:
    space = ("mesh", "rest")[said.space]
    content_hash = f"{said.content_hash:016x}" if said.has_hash else "-"
    return (
        f"track {said.track_id} {NAMES[said.model, said.coding]} {space} {said.application:016x} {content_hash} "
        f"{floats(said.aabb)} {quoted(said.path)}"
    )


def grid_line(said: Grid) -> str:
    dx, dy, dz = said.dims
    return (
        f"grid {said.track_id} {dx} {dy} {dz} {said.bucket_count} {said.cell_capacity} "
        f"{said.position_bits},{said.normal_bits},{said.ao_bits} "
        f"{floats((said.edge, said.radius) + said.grid_from_mesh)}"
    )


def volume_line(said: Volume) -> str:
    dx, dy, dz = said.dims
    return (
        f"volume {said.track_id} {dx} {dy} {dz} {said.exponent} {said.side} "
        f"{','.join(map(str, said.map_steps))} {','.join(map(str, said.steps))} "
        f"{floats(said.spacing + (said.range,) + said.grid_from_mesh)}"
    )


def vertex_set_line(said: VertexSet) -> str:
    a, b = said.kinds
    return (
        f"vertices {said.track_id} {said.count} {said.bits} {said.order} {said.signals} {a},{b} "
        f"{floats(said.distances + (said.share,))}"
    )


def table_line(said: Table) -> str:
    a, b = said.kinds
    return (
        f"instances {said.track_id} {said.count} {said.exponent} {said.step} {said.signals} {a},{b} "
        f"{floats(said.distances + (said.share,))}"
    )


def region_set_line(said: RegionSet) -> str:
    a, b = said.kinds
    return (
        f"regions {said.track_id} {said.count} {said.capacity} {said.exponent} {said.step} {said.signals} {a},{b} "
        f"{floats(said.distances + (said.share,))}"
    )


def floats(values: tuple[int, ...] | list[int]) -> str:
    """f32, each as its bits."""
    return " ".join(f"{bits:08x}" for bits in values)


def quoted(path: str) -> str:
    """A path between double quotes."""
    out = []
    for char in path:
        if char in '"\\':
            out.append("\\" + char)
        elif char < " " or char == "\x7f":
            out.append(f"\\u{ord(char):04x}")
        else:
            out.append(char)
    return '"' + "".join(out) + '"'
