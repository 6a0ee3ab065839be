"""A decoder of the Dapple format, as a program that speaks the conformance protocol.

    decoder.py [--limit NAME=VALUE]... [--live] [--pieces N] [--partial]   a stream to its dump
    decoder.py --session                                                  a script to a transcript
    decoder.py --queries                                                  AO or light at positions
    decoder.py --batch                                                    many of these requests

Exit code: 0 complete, 1 refused, 2 more input is needed (--partial), 64 wrong
arguments, 70 a fault of this program.
"""

import io
import struct
import sys
import traceback
from dataclasses import dataclass, field
from typing import BinaryIO

import instances
import regions
import vertices
from container import Decoder
from dump import Dump
from errors import Fault
from light import INTERPOLATIONS, Light
from limits import Limits
from sampling import ambient_occlusion, normalised
from session import Track
from tracks import INSTANCES, POINTS, REGIONS, VERTICES

COMPLETE, REFUSED, NEED_INPUT, USAGE, BROKEN = 0, 1, 2, 64, 70


class UsageError(Exception):
    """Arguments or a script that the protocol does not have."""


@dataclass
class Options:
    """The arguments of a request."""

    limits: Limits = field(default_factory=Limits)
    live: bool = False
    pieces: int = 0  # 0: all at once
    session: bool = False
    queries: bool = False
    batch: bool = False
    partial: bool = False


def read_options(words: list[str]) -> Options:
    options = Options()
    rest = iter(words)
    try:
        for word in rest:
            if word == "--limit":
                name, _, value = next(rest).partition("=")
                if name not in vars(options.limits):
                    raise UsageError(f"no limit {name}")
                setattr(options.limits, name, int(value))
            elif word == "--pieces":
                options.pieces = max(0, int(next(rest)))
            elif word in ("--live", "--session", "--queries", "--batch", "--partial"):
                setattr(options, word[2:], True)
            else:
                raise UsageError(f"no argument {word}")
    except (StopIteration, ValueError):
        raise UsageError(f"a value is missing or wrong: {' '.join(words)}") from None
    return options


def answer(options: Options, data: bytes, out: BinaryIO) -> int:
    """One request; returns its exit code."""
    if options.session:
        return run_session(options, data, out)
    if options.queries:
        return run_queries(options, data, out)
    return run_stream(options, data, Decoder(options.limits, Dump(out)), out)


# ---- A stream to its dump ----


def run_stream(options: Options, data: bytes, decoder: Decoder, out: BinaryIO) -> int:
    try:
        size = options.pieces or len(data) or 1
        for at in range(0, len(data), size):
            decoder.push(data[at : at + size])
        if options.partial and not decoder.ended:
            return NEED_INPUT
        decoder.finish(options.live)
    except Fault as fault:
        line = f'{{"layer":"{fault.layer}","id":{fault.number},"offset":{fault.offset}}}\n'
        out.write(line.encode())
        return REFUSED
    return COMPLETE


# ---- A script to a transcript ----


def run_session(options: Options, data: bytes, out: BinaryIO) -> int:
    dump = Dump(out)
    decoder = Decoder(options.limits, dump)
    script = io.BytesIO(data)
    for command in iter(script.readline, b""):
        words = command.decode("utf-8", "replace").split()
        try:
            if len(words) == 2 and words[0] == "push" and words[1].isdecimal():
                size = int(words[1])
                data = script.read(size)
                if len(data) != size:
                    raise UsageError("a push has fewer bytes than it says")
                push(decoder, data, options.pieces)
            elif words == ["resume"]:
                if decoder.resume():
                    dump.line("resume yes")
                    decoder.push(b"")  # what was kept
                else:
                    dump.line("resume no")
            elif words == ["reset"]:
                decoder.reset()
                dump.line("reset")
            elif words in (["finish"], ["finish-live"]):
                decoder.finish(live=words == ["finish-live"])
                dump.line("finished")
            else:
                raise UsageError(f"no command {' '.join(words)}")
        except Fault as fault:
            dump.line(f"error {fault.layer} {fault.number} {fault.offset}")
    return COMPLETE


def push(decoder: Decoder, data: bytes, pieces: int) -> None:
    """Push in pieces. After a fault the rest is kept; a push into a stopped decoder is lost."""
    size = pieces or len(data) or 1
    for at in range(0, len(data), size):
        try:
            decoder.push(data[at : at + size])
        except Fault as fault:
            if fault.number != 4011:
                decoder.keep(data[at + size :])
            raise


# ---- Queries ----


class Silent:
    """An observer that keeps nothing."""

    def stream(self, *_: object) -> None: ...
    def group(self, *_: object) -> None: ...
    def frame(self, *_: object) -> None: ...
    def end(self, *_: object) -> None: ...
    def skipped(self, *_: object) -> None: ...


def run_queries(options: Options, data: bytes, out: BinaryIO) -> int:
    if len(data) < 4:
        raise UsageError("queries need a length and a stream")
    stream_end = 4 + int.from_bytes(data[:4], "little")
    decoder = Decoder(options.limits, Silent())
    status = run_stream(options, data[4:stream_end], decoder, out)
    if status != COMPLETE:
        return status
    lights: dict[int, Light] = {}
    for line in data[stream_end:].split(b"\n"):
        words = line.decode("utf-8", "replace").split()
        if not words:
            continue
        if not words[0].isdecimal():
            raise UsageError("a query begins with a track")
        track_id = int(words[0])
        track = decoder.session.live(track_id)
        if track is None:
            raise UsageError(f"no track {track_id}")
        if track.declaration.model == POINTS:
            numbers = [query_points(track, words[1:])]
        elif track.declaration.model == VERTICES:
            numbers = [query_vertices(track, words[1:])]
        elif track.declaration.model == INSTANCES:
            numbers = [query_instances(track, line.decode("utf-8", "replace"))]
        elif track.declaration.model == REGIONS:
            numbers = [query_regions(track, words[1:])]
        else:
            if track_id not in lights:
                lights[track_id] = Light(track.declaration, track.content)
            numbers = query_probes(lights[track_id], words[1:])
        out.write(" ".join(f"{number:.9f}" for number in numbers).encode() + b"\n")
    return COMPLETE


def query_points(track: Track, words: list[str]) -> float:
    x, y, z, nx, ny, nz = integers(words, 6)
    return ambient_occlusion(
        track.declaration,
        track.content,
        (x / 65536, y / 65536, z / 65536),
        normalised((nx, ny, nz)),
    )


def query_vertices(track: Track, words: list[str]) -> float:
    *corners, u, v, w = integers(words, 6)
    whole = u + v + w == 65536 and min(u, v, w) >= 0
    if not whole or not all(0 <= corner < track.declaration.count for corner in corners):
        raise UsageError("a query of vertices names three of them, with weights of 65536 in all")
    weights = [u / 65536, v / 65536, w / 65536]
    return vertices.ambient_occlusion(track.declaration, track.content, corners, weights)


def query_instances(track: Track, line: str) -> float:
    words = line.split(" ", 5)  # the path is the rest of the line
    if len(words) != 6:
        raise UsageError("a query of instances ends with a path")
    x, y, z, local = integers(words[1:5], 4)
    p = (x / 65536, y / 65536, z / 65536)
    return instances.ambient_occlusion(track.declaration, track.content, words[5], p, local / 65536)


def query_regions(track: Track, words: list[str]) -> float:
    x, y, z, nx, ny, nz = integers(words, 6)
    return regions.ambient_occlusion(
        track.declaration,
        track.content,
        (x / 65536, y / 65536, z / 65536),
        normalised((nx, ny, nz)),
    )


def query_probes(light: Light, words: list[str]) -> list[float]:
    *words, interpolation = words or [""]
    if interpolation not in INTERPOLATIONS:
        raise UsageError("a query of probes ends with an interpolation")
    x, y, z, nx, ny, nz, vx, vy, vz, roughness = integers(words, 10)
    irradiance, radiance = light.ask(
        (x / 65536, y / 65536, z / 65536),
        normalised((nx, ny, nz)),
        normalised((vx, vy, vz)),
        roughness / 65536,
        interpolation,
    )
    return irradiance + radiance


def integers(words: list[str], count: int) -> list[int]:
    try:
        numbers = [int(word) for word in words]
    except ValueError:
        raise UsageError("a query has a word that is no integer") from None
    if len(numbers) != count:
        raise UsageError(f"a query has {len(numbers)} integers where {count} are expected")
    return numbers


# ---- Many requests ----


def run_batch(stdin: BinaryIO, stdout: BinaryIO) -> None:
    while True:
        head = stdin.read(4)
        if not head:
            return
        words = read_exactly(stdin, struct.unpack("<I", head)[0]).decode().split()
        data = read_exactly(stdin, struct.unpack("<I", read_exactly(stdin, 4))[0])
        out = io.BytesIO()
        try:
            status = answer(read_options(words), data, out)
        except UsageError as error:
            print(error, file=sys.stderr)
            status = USAGE
        output = out.getvalue()
        stdout.write(struct.pack("<BI", status, len(output)) + output)
        stdout.flush()


def read_exactly(stdin: BinaryIO, size: int) -> bytes:
    data = stdin.read(size)
    if len(data) != size:
        raise UsageError("a request ends early")
    return data


def main() -> int:
    try:
        options = read_options(sys.argv[1:])
        if options.batch:
            run_batch(sys.stdin.buffer, sys.stdout.buffer)
            return COMPLETE
        return answer(options, sys.stdin.buffer.read(), sys.stdout.buffer)
    except UsageError as error:
        print(error, file=sys.stderr)
        return USAGE
    except Exception:
        traceback.print_exc()
        return BROKEN
    finally:
        sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
