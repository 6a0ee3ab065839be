"""Tests: the worked example and what is built from it, and volumes of probes that are made up. Run with `python test_decoder.py SPEC_FOLDER`."""

import io
import math
import random
import re
import struct
import sys
from dataclasses import replace
from pathlib import Path

import lz4.block
import zstandard

import instances
import light
import probes
from decoder import answer, read_options
from digest import crc32c, xxh64
from errors import Fault
from limits import Limits
from packing import unpack_lz4, unpack_zstd
from rangecoder import RangeDecoder
from sampling import dot, normalised, octahedral
from tracks import PACKED, RAW, Table, Volume

SPEC = Path(sys.argv[1])


def worked(page: str, kind: str) -> tuple[bytes, bytes]:
    """The stream of a page, in all its blocks of bytes, and the block that it comes to."""
    text = (SPEC / page).read_text(encoding="utf-8")
    stream = bytearray()
    for block in re.findall(r"```hex\n(.*?)```", text, re.S):
        for line in block.splitlines():
            stream += bytes.fromhex(line.split(";")[0])
    return bytes(stream), re.search(rf"```{kind}\n(.*?)```", text, re.S)[1].encode()


def example() -> tuple[bytes, bytes]:
    """The stream of examples.md and its dump."""
    return worked("examples.md", "dump")


def run(data: bytes, arguments: str = "") -> tuple[int, bytes]:
    out = io.BytesIO()
    return answer(read_options(arguments.split()), data, out), out.getvalue()


def record(
    kind: int, payload: bytes, sequence: int, packing: int = 0, unpacked: int | None = None,
    critical: bool = True,
) -> bytes:
    size = len(payload) if unpacked is None else unpacked
    head = struct.pack(
        "<HBBIQIII", kind | (0x8000 if critical else 0), 0, packing, 0, sequence, len(payload),
        size, crc32c(payload),
    )
    return head + struct.pack("<I", crc32c(head)) + payload


def records(stream: bytes) -> list[bytes]:
    """The preamble and the records of a good stream."""
    out, at = [stream[:16]], 16
    while at < len(stream):
        size = 32 + int.from_bytes(stream[at + 16 : at + 20], "little")
        out.append(stream[at : at + size])
        at += size
    return out


def fault_of(call, *arguments) -> int:
    try:
        call(*arguments)
    except Fault as fault:
        return fault.number
    return 0


def test_digests() -> None:
    assert crc32c(b"123456789") == 0xE3069283
    assert xxh64(b"") == 0xEF46DB3751D8E999
    assert xxh64(b"abc") == 0x44BC2CF5AD770999


def test_example() -> None:
    stream, dump = example()
    assert len(stream) == 1754
    for arguments in ("", "--pieces 1", "--pieces 7", "--live", "--partial"):
        assert run(stream, arguments) == (0, dump), arguments


def test_cut() -> None:
    """Every prefix needs more, and is truncated where nothing more comes."""
    stream, dump = example()
    commits = (996, 1032, 1288, 1706, 56, 372)  # ends of records with no frame open
    for size in range(len(stream)):
        status, output = run(stream[:size])
        assert status == 1
        assert output.endswith(b'{"layer":"framing","id":1019,"offset":%d}\n' % size)
        assert run(stream[:size], "--partial")[0] == 2
        status, output = run(stream[:size], "--live")
        assert (status == 0) == (size in commits), size


def test_flips() -> None:
    """Any damaged bit is an error, and the same one however the stream is cut.

    But in the payload of the record that is skipped, which nothing is checked in [C-017].
    """
    stream, dump = example()
    for at in range(len(stream)):
        if at in range(1028, 1032):
            continue
        damaged = bytearray(stream)
        damaged[at] ^= 1 << at % 8
        whole = run(bytes(damaged))
        assert whole[0] == 1
        assert run(bytes(damaged), "--pieces 5") == whole


def test_trailing() -> None:
    stream, dump = example()
    assert run(stream + b"x") == (1, dump + b'{"layer":"framing","id":1020,"offset":1754}\n')


def test_lz4() -> None:
    for data in (b"", b"a", b"abcabcabcabcabcabcabc" * 9, bytes(100000), random.Random(1).randbytes(999)):
        packed = lz4.block.compress(data, store_size=False)
        assert unpack_lz4(packed, len(data)) == data
        if data:
            assert fault_of(unpack_lz4, packed, len(data) - 1) == 1015
        assert fault_of(unpack_lz4, packed, len(data) + 1) == 1015
        assert fault_of(unpack_lz4, packed[:-1], len(data)) == 1015
    assert fault_of(unpack_lz4, b"", 0) == 1015
    assert fault_of(unpack_lz4, b"\x14A\0\0\x50abcde", 14) == 1015  # offset 0
    assert fault_of(unpack_lz4, b"\x14A\2\0\x50abcde", 14) == 1015  # before the start
    assert fault_of(unpack_lz4, b"\x14A\1\0", 9) == 1015  # ends with a match
    # End conditions [C-035]: the match starts 12 bytes before the end and ends 5 before it.
    assert unpack_lz4(b"\x13A\1\0\x50abcde", 13) == b"AAAAAAAAabcde"
    assert unpack_lz4(b"\x14A\1\0\x50abcde", 14) == b"AAAAAAAAAabcde"
    assert fault_of(unpack_lz4, b"\x12A\1\0\x50abcde", 12) == 1015
    assert fault_of(unpack_lz4, b"\x14A\1\0\x40abcd", 13) == 1015
    assert fault_of(unpack_lz4, b"\x14A\1\0\0", 9) == 1015


def test_zstd() -> None:
    limits = Limits()
    for data in (b"", b"a", b"abc" * 99, bytes(500000), random.Random(1).randbytes(200000)):
        for level in (1, 19):
            packed = zstandard.ZstdCompressor(level=level).compress(data)
            assert unpack_zstd(packed, len(data), limits) == data
            assert fault_of(unpack_zstd, packed, len(data) + 1, limits) == 1017
            assert fault_of(unpack_zstd, packed[:-1], len(data), limits) == 1017
            assert fault_of(unpack_zstd, packed + b"x", len(data), limits) == 1017
    magic = b"\x28\xb5\x2f\xfd"
    # No content, and a block of noise, or of a byte; for a single segment the window is 0.
    for block in (b"\x2d\0\0\xff\xff\xff\xff\xff", b"\x09\0\0A"):
        assert fault_of(unpack_zstd, magic + b"\x80\0\0\0\0\0" + block, 0, limits) == 1016
        assert fault_of(unpack_zstd, magic + b"\x20\0" + block, 0, limits) == 1017
    # A window of 1024 bytes holds no raw block of 1025 [C-031].
    for size, wanted in ((1024, 0), (1025, 1017)):
        block = (size << 3 | 1).to_bytes(3, "little") + bytes(size)
        frame = magic + b"\x40\0" + (size - 256).to_bytes(2, "little") + block
        assert fault_of(unpack_zstd, frame, size, limits) == wanted, size
    assert fault_of(unpack_zstd, magic + b"\x24\0\x01\0\0", 0, limits) == 1017


def script(*parts: bytes | str) -> bytes:
    out = b""
    for part in parts:
        out += part.encode() + b"\n" if isinstance(part, str) else b"push %d\n" % len(part) + part
    return out


def test_sessions() -> None:
    stream, dump = example()
    assert run(script(stream, "finish"), "--session") == (0, dump + b"finished\n")
    parts = records(stream)
    # The first commit is lost: the delta's header is a gap; the resynchronisation ends at the
    # group from keyframes, of which there is none but the lost one; `end` ends it.
    lost = b"".join(parts[:6] + parts[7:])
    status, output = run(script(lost, "resume", "finish"), "--session")
    lines = output.decode().splitlines()
    assert lines == [
        "dapple-dump 1", "stream 60 1", "group 0 keyframes", "error framing 1008 940",
        "resume yes", "end", "finished",
    ], lines
    # A payload is damaged after the first commit; the state of frame 0 is not that of group 1.
    damaged = bytearray(stream)
    damaged[1072] ^= 1
    status, output = run(script(bytes(damaged), "resume", "finish"), "--session")
    lines = output.decode().splitlines()
    assert "error framing 1011 1064" in lines and lines[-3:] == ["resume yes", "end", "finished"]
    # Refused, then forgotten.
    assert run(script(b"x" * 20, "resume", "reset", stream, "finish"), "--session")[1].decode() == (
        "dapple-dump 1\nerror framing 1001 0\nresume no\nreset\n"
        + dump.decode().removeprefix("dapple-dump 1\n") + "finished\n"
    )


def test_loss() -> None:
    """loss.md, whole and in pieces."""
    stream, transcript = worked("loss.md", "transcript")
    commands = script(stream, "resume", "resume", "resume", "finish")
    for arguments in ("--session", "--session --pieces 1", "--session --pieces 50"):
        assert run(commands, arguments) == (0, transcript), arguments


def test_stopped() -> None:
    """A decoder that stopped takes in nothing; the end of the input is a question."""
    stream, _ = example()
    parts = records(stream)
    gap = parts[0] + parts[2]
    steps = script(gap, b"lost", "finish", "resume", "finish-live", "resume")
    # The header, looked at again, is an unreported 4007, and its payload is skipped.
    assert run(steps, "--session")[1].decode().splitlines()[1:] == [
        "error framing 1008 16", "error session 4011 48", "error session 4011 48", "resume yes",
        f"error framing 1019 {len(gap)}", "resume yes",
    ]
    half = len(stream) // 2
    steps = script(stream[:half], "finish", "finish-live", "resume", stream[half:], "finish", "finish")
    output = run(steps, "--session")[1].decode().splitlines()
    kept = [line for line in output if line.split()[0] in ("error", "resume", "finished", "end")]
    error = f"error framing 1019 {half}"
    assert kept == [error, error, "resume yes", "end", "finished", "finished"], kept


def test_resume() -> None:
    """Two groups from keyframes; the first frame is damaged, the second is decoded."""
    stream, _ = example()
    parts = records(stream)
    first, track, group, points = [part[32:] for part in parts[1:5]]
    commits = [struct.pack("<QII", number, number, 0) for number in range(3)]
    items = [
        (1, first), (3, track), (2, group), (0x20, points), (6, commits[0]),
        (2, group), (0x20, points), (6, commits[1]), (7, bytes(16)),
    ]
    built = [record(kind, data, sequence) for sequence, (kind, data) in enumerate(items)]
    for lost in range(1, 5):
        out = parts[0] + b"".join(built[:lost] + built[lost + 1 :])
        status, output = run(script(out, "resume", "finish"), "--session")
        lines = [line for line in output.decode().splitlines() if line.split()[0] not in ("grid", "bucket")]
        shown = [line.split()[0] for line in lines[lines.index("resume yes") :]]
        # The declaration of the tracks may be what is lost; then `points` is a fault again.
        if lost == 1:
            assert shown == ["resume", "group", "error", "error"], shown  # the second by `finish`
        else:
            assert shown == ["resume", "group", "frame", "track", "track", "end", "finished"], shown
    # A stream that begins without `stream`: a gap, and then each header is a fault.
    out = parts[0] + b"".join(built[1:])
    status, output = run(script(out, *["resume"] * 8, "finish"), "--session")
    assert output.count(b"error session 4007") == 7, output
    assert output.endswith(b"resume yes\nerror framing 1019 %d\n" % len(out)), output


def test_noise() -> None:
    """Noise in packed payloads and headers: a fault or a result, and nothing else."""
    rng = random.Random(3)
    limits = Limits()
    for _ in range(20000):
        noise = rng.randbytes(rng.randrange(40))
        fault_of(unpack_lz4, noise, rng.randrange(200))
        size = rng.randrange(256)
        fault_of(unpack_zstd, b"\x28\xb5\x2f\xfd\x20" + bytes([size]) + noise, size, limits)
        body = rng.randbytes(rng.randrange(30))
        head = bytes([size]) + bytes([(len(body) << 3 | 5) & 255, len(body) >> 5, 0]) + body
        fault_of(unpack_zstd, b"\x28\xb5\x2f\xfd\x20" + head, size, limits)


def test_sampling() -> None:
    """The fragments worked out in points.md, section 8; then one near a point of AO 203."""
    stream, _ = example()
    half = stream[:1288]
    queries = b"1 58880 2048 60416 0 1 0\n1 50688 8192 53760 0 1 0\n"
    status, output = run(len(half).to_bytes(4, "little") + half + queries, "--queries --live")
    worked_out, above = [float(line) for line in output.split()]
    assert status == 0 and abs(worked_out - 0.481541) < 1e-6 and above == 1.0, output
    head = len(stream).to_bytes(4, "little") + stream
    status, output = run(head + b"1 43520 512 66048 0 1 0\n1 43520 512 66048 0 -1 0\n", "--queries")
    first, second = [float(line) for line in output.split()]
    assert status == 0 and second == 1.0, output
    assert 200 / 255 < first < 203 / 255, output
    normal = octahedral(-3, -7, 4)
    assert abs(sum(v * v for v in normal) - 1) < 1e-12 and normal[2] < 0
    assert octahedral(-8, 0, 4) == octahedral(-7, 0, 4) == (-1, 0, 0)


def test_mutations() -> None:
    """Payloads damaged under good checksums: never an unexpected exception."""
    stream, _ = example()
    parts = records(stream)
    plain = []
    for part in parts[1:]:
        kind, _, packing = struct.unpack_from("<HBB", part)
        size = int.from_bytes(part[20:24], "little")
        data = part[32:]
        if packing == 1:
            data = unpack_lz4(data, size)
        elif packing == 2:
            data = unpack_zstd(data, size, Limits())
        plain.append((kind & 0x7FFF, bool(kind & 0x8000), data))
    rng = random.Random(7)
    seen: set[bytes] = set()
    for _ in range(6000):
        some = list(plain)
        which = rng.randrange(len(some))
        kind, critical, data = some[which]
        data = bytearray(data)
        for _ in range(rng.choice((1, 1, 1, 2))):
            how = rng.randrange(5)
            at = rng.randrange(len(data) + 1)
            if how == 0:
                data[at:at] = rng.randbytes(rng.choice((1, 4)))
            elif how == 1:
                del data[at : at + rng.choice((1, 4, 8))]
            elif data:
                at = rng.randrange(len(data))
                data[at] = rng.choice((0, 1, 255, data[at] ^ 1 << rng.randrange(8)))
        some[which] = (kind, critical, bytes(data))
        if rng.random() < 0.1:
            del some[rng.randrange(len(some))]
        out = parts[0]
        for sequence, (kind, critical, data) in enumerate(some):
            if rng.random() < 0.1:
                packed = lz4.block.compress(data, store_size=False)
                out += record(kind, packed, sequence, 1, len(data), critical)
            else:
                out += record(kind, data, sequence, critical=critical)
        status, output = run(out)
        assert (status, output) == run(out, "--pieces 100")
        last = output.splitlines()[-1]
        seen.add(last.partition(b',"offset"')[0])
        run(script(out[: len(out) // 2], "resume", out[len(out) // 2 :], "resume", "resume", "finish"), "--session")
    print(sorted(seen))


# ---- probes.md ----


class RangeEncoder:
    """The counterpart of the range decoder (section 6.2): draws bits, and writes them down."""

    def __init__(self, rng: random.Random) -> None:
        self.rng = rng
        self.state = (0, 2**32 - 1, 4)  # low, range, bytes so far
        self.estimates = RangeDecoder(b"", probes.STARTS, probes.ENTROPY).estimates

    def bounded(self, bound: int, bit: int) -> int:
        low, size, count = self.state
        low, size = (low + bound, size - bound) if bit else (low, bound)
        while size < 2**24:
            low, size, count = low << 8, size << 8, count + 1
        self.state = low, size, count
        return bit

    def bit(self, context: int) -> int:
        """Probable bits mostly, and improbable ones now and then."""
        q = self.estimates[context]
        bit = int(self.rng.randrange(65536) >= (q if self.rng.random() < 0.8 else 32768))
        self.bounded((self.state[1] >> 16) * q, bit)
        self.estimates[context] = q - (q >> 5) if bit else q + ((65536 - q) >> 5)
        return bit

    def even(self) -> int:
        return self.bounded(self.state[1] >> 1, self.rng.getrandbits(1))

    def finish(self) -> bytes:
        """All P bytes, of which three at least are 0 at the end."""
        low, size, count = self.state
        last = low + size - 1
        return (last >> 24 << 24).to_bytes(count, "big")


def drawn(rng: random.Random, track: Volume, before: probes.Content) -> tuple[bytes, dict]:
    """A section that was drawn, and the probes that it leaves."""
    encoder = RangeEncoder(rng)
    decoding = probes.Decoding(encoder, track, before)
    for index in range(track.probes):
        while len(decoding.after) == index:
            kept = encoder.state, list(encoder.estimates)
            try:
                decoding.decode_probe(index)
            except Fault:  # a code out of range; another draw
                encoder.state, encoder.estimates = kept
    return encoder.finish(), {i: probe for i, probe in enumerate(decoding.after) if probe.level}


ONE = 0x3F800000


def volume(coding: int, dims: tuple = (2, 2, 2), side: int = 0, steps: tuple | None = None) -> Volume:
    """A declaration with an AABB and a matrix of zeros."""
    if steps is None:
        steps = (16, 128, 128, 128, 320, 320) if coding == PACKED else (0,) * 6
    return Volume(
        7, coding, 0, 0, False, 0, "", (0,) * 6, (0,) * 12, dims, (ONE,) * 3, 0, side,
        ONE if side else 0, steps, (9, 7) if side and coding == PACKED else (0, 0),
    )


def entry(track: Volume) -> bytes:
    return struct.pack(
        "<IIHHBBHQQ6I12I3H2x3Ib3BI6H", 144, track.track_id, 2, track.coding, track.space, 0, 0, 0, 0,
        *track.aabb, *track.grid_from_mesh, *track.dims, *track.spacing, track.exponent, track.side,
        *track.map_steps, track.range, *track.steps,
    )


def probes_record(section: bytes, base: int | None = None, flags: int = 0, track_id: int = 7) -> bytes:
    head = struct.pack("<4I", 1, base is None, base or 0, 0)
    return head + struct.pack("<3I", track_id, len(section), flags) + section


def stream_of(*items: tuple[int, bytes]) -> bytes:
    """A stream of records, with the one before and the one after all streams."""
    preamble = records(example()[0])[0]
    items = ((1, struct.pack("<2I", 60, 1)), *items)
    return preamble + b"".join(record(kind, data, at) for at, (kind, data) in enumerate(items))


def frames_of(track: Volume, payloads: list[bytes]) -> bytes:
    """A stream with one record of probes a frame."""
    items = [(3, struct.pack("<II", 1, 0) + entry(track)), (2, bytes(16))]
    for number, payload in enumerate(payloads):
        items += [(0x21, payload), (6, struct.pack("<QII", number, number, 0))]
    return stream_of(*items)


def outcome(stream: bytes, arguments: str = "--live") -> int:
    """The error of a stream, or 0."""
    status, output = run(stream, arguments)
    found = re.search(rb'"id":(\d+)', output.splitlines()[-1])
    return int(found[1]) if status == 1 else 0


def test_tables() -> None:
    assert xxh64(probes.STARTS) == 0xC9BABDB0EF270E13
    assert xxh64(struct.pack("<256I", *probes.POWERS)) == 0x1955658E0278180E
    assert [probes.POWERS[i] for i in (0, 1, 128, 255)] == [32768, 32857, 46341, 65359]
    first = {"CHANGED": 0, "OTHER": 8, "LEVEL": 9, "ANY": 17, "SOME": 113, "AGAINST": 161, "LONGER": 173, "SECOND": 245}
    for name, number in first.items():
        assert getattr(probes, name).first == number, name
    assert probes.ANY(1, 2, 3, 1) == 17 + ((1 * 6 + 2) * 4 + 3) * 2 + 1


def test_f16() -> None:
    """Against the f16 of `struct`: each value itself, each tie, and its neighbours."""
    for bits in range(0x7BFF):
        value = probes.units_from_f16(bits)
        assert value == struct.unpack("<e", struct.pack("<H", bits))[0] * 2**24
        above = probes.units_from_f16(bits + 1)
        even = bits + bits % 2
        assert probes.f16_from_units(value) == bits
        assert probes.f16_from_units(-value) == (bits | 0x8000 if bits else 0)
        half = (value + above) // 2
        if above - value > 1:
            assert probes.f16_from_units(half) == even
            assert probes.f16_from_units(half - 1) == bits
            assert probes.f16_from_units(half + 1) == bits + 1
    assert probes.f16_from_units(2**60) == 0x7BFF and probes.f16_from_units(-(2**60)) == 0xFBFF


def test_sections() -> None:
    """Sections that were drawn decode to what they were drawn as."""
    rng = random.Random(11)
    levels = set()
    for _ in range(300):
        dims = (rng.randint(1, 4), rng.randint(1, 4), rng.randint(1, 3))
        steps = (rng.choice((1, 16, 300, 2560)), *(rng.choice((1, 100, 5000, 32768)) for _ in range(5)))
        track = volume(PACKED, dims, steps=steps)
        before = probes.Content()
        for _ in range(3):
            section, after = drawn(rng, track, before)
            assert probes.read_packed(track, section, before, False).probes == after
            # Bytes of 0 at the end may be left out, up to four [B-034], and none added.
            for short in range(1, len(section)):
                if section[-short]:
                    break
                if short <= 4:
                    assert probes.read_packed(track, section[:-short], before, False).probes == after
                else:
                    assert fault_of(probes.read_packed, track, section[:-short], before, False) == 3105
            assert fault_of(probes.read_packed, track, section + b"\0", before, False) == 3105
            before = probes.Content(after)
            levels |= {probe.level for probe in after.values()}
    assert levels == {1, 2, 3}


def test_code_range() -> None:
    """[B-042] at its edges."""
    for steps, i, g, inside in (
        ((1, 1, 1, 1, 1, 1), 0, 0, (0, 10239)),
        ((2560, 1, 1, 1, 1, 1), 0, 0, (0, 3)),
        ((1, 1, 1, 1, 1, 1), 1, 1, (-32768, 32767)),
        ((1, 1, 1, 1, 1, 32768), 26, 5, (-1, 1)),
        ((1, 1, 1, 1, 3, 1), 12, 4, (-10922, 10922)),
    ):
        decoding = probes.Decoding(RangeEncoder(random.Random(1)), volume(PACKED, steps=steps), probes.Content())
        for code in inside:
            assert fault_of(decoding.check_code, i, g, code) == 0
        for code in (inside[0] - 1, inside[1] + 1):
            assert fault_of(decoding.check_code, i, g, code) == 3104


def test_values() -> None:
    """By hand: luma 1 and its chroma; and luma against the power itself."""
    track = volume(PACKED, (1, 1, 1), steps=(256, 2048, 1, 1, 1, 1))
    # 24 octaves above 2^-24; Co half of it, Cg none: 1.5, 1, 0.5.
    probe = probes.Probe(1, (24, 1) + (0,) * 25)
    assert probes.probe_values(track, probe) == (0x3E00, 0x3C00, 0x3800) + (0,) * 24
    # Chroma beyond luma: blue is below 0, and so 0 in degree 0.
    probe = probes.Probe(1, (24, 4) + (0,) * 25)
    assert probes.probe_values(track, probe)[:3] == (0x4200, 0x3C00, 0)
    assert probes.probe_values(track, probes.Probe(3, (0,) + (9,) * 26)) == (0,) * 27
    track = volume(PACKED, (1, 1, 1), steps=(1, 1, 1, 1, 1, 1))
    for e in range(1, 10240):
        value = probes.units_from_f16(probes.probe_values(track, probes.Probe(1, (e,) + (0,) * 26))[0])
        exact = min(2 ** (e / 256), 65504 * 2**24)
        assert abs(value - exact) <= 1 + exact * 2**-11 * 1.04, e  # the floor, half a step and T


def test_fill() -> None:
    """[B-060] against distances by their definition."""
    rng = random.Random(5)
    for _ in range(60):
        dims = (rng.randint(1, 5), rng.randint(1, 4), rng.randint(1, 3))
        track = volume(RAW, dims)
        places = [probes.place(track, index) for index in range(track.probes)]
        there = {
            index: probes.Probe(3, tuple(rng.randrange(0x7C00) | (0x8000 if v > 2 else 0) for v in range(27)))
            for index in range(track.probes) if rng.random() < 0.2
        }
        values = probes.all_values(track, probes.Content(there))
        if not there:
            assert values == [(0,) * 27] * track.probes
            continue

        def steps(a: int, b: int) -> int:
            return sum(abs(i - j) for i, j in zip(places[a], places[b]))

        far = [min(steps(index, other) for other in there) for index in range(track.probes)]
        for index in range(track.probes):
            if far[index] == 0:
                assert values[index] == there[index].codes
                continue
            near = [q for q in range(track.probes) if steps(index, q) == 1 and far[q] == far[index] - 1]
            for v in range(27):
                mean = sum(probes.units_from_f16(values[q][v]) for q in near) // len(near)
                assert values[index][v] == probes.f16_from_units(mean)


def test_probes_errors() -> None:
    """The checks of a declaration, of a record and of a raw section, each in its turn."""
    raw, packed = volume(RAW), volume(PACKED)
    minus, nothing = 0x80000000, struct.pack("<BB", 0, 0)
    for track, wanted in (
        (raw, 0), (packed, 0), (replace(raw, space=1), 2020), (replace(raw, coding=2), 2008),
        (replace(raw, steps=(0, 0, 0, 0, 0, 1)), 2002), (replace(raw, dims=(0, 1, 1)), 2022),
        (replace(raw, dims=(4096, 4096, 2)), 2022), (replace(raw, spacing=(ONE, minus, ONE)), 2023),
        (replace(raw, exponent=65), 2024), (replace(raw, exponent=-65), 2024), (replace(raw, side=5), 2025),
        (replace(raw, side=4), 2025), (replace(raw, range=ONE), 2025), (replace(raw, range=minus), 2025),
        (replace(raw, map_steps=(1, 0)), 2025), (replace(packed, map_steps=(0, 1)), 2025),
        (replace(volume(PACKED, side=4), map_steps=(9, 0)), 2025), (volume(PACKED, side=8), 0),
        (replace(packed, steps=(2561, 1, 1, 1, 1, 1)), 2026), (replace(packed, steps=(1, 1, 1, 1, 1, 32769)), 2026),
        (replace(packed, steps=(1, 1, 0, 1, 1, 1), exponent=99), 2024),
    ):
        assert outcome(stream_of((3, struct.pack("<II", 1, 0) + entry(track)))) == wanted, track
    one = struct.pack("<I", 1) + bytes(4) + entry(raw)[:-4]
    assert outcome(stream_of((3, one))) == 2001

    value = struct.pack("<28H", *range(1, 28), 0)
    good = b"\x05\x04" + value  # probe 0 becomes absent, probe 2 is there
    eight = value[:6] + struct.pack("<H", 0xFC00) + value[8:]
    for section, wanted in (
        (good, 0), (nothing, 0), (b"\0", 3101), (b"\x05\x06" + value, 3102), (good[:-1], 3101), (good + b"\0", 3101),
        (good[:-1] + b"\1", 3102), (b"\x04\x04" + eight[:-2] + b"\1\0", 3103),
        (b"\x04\x04\x00\x80" + value[2:], 3103), (b"\x04\x04" + value[:6] + b"\x00\x80" + value[8:], 0),
    ):
        assert outcome(frames_of(raw, [probes_record(section)])) == wanted, section
    three = volume(RAW, (3, 1, 1))
    assert outcome(frames_of(three, [probes_record(b"\x08\x00")])) == 3102

    # Visibility goes with a keyframe that has none, and stays with such a delta.
    seen = volume(RAW, (1, 1, 1), side=4)
    block = bytes(range(32))
    payloads = [probes_record(block + b"\1\1" + value, flags=1), probes_record(b"\1\0", 0)]
    status, dump = run(frames_of(seen, payloads), "--live")
    assert status == 0 and dump.count(b"visibility 7 %016x" % xxh64(block)) == 2 and dump.count(b"probe 7 ") == 1
    status, dump = run(frames_of(seen, [payloads[0], probes_record(nothing)]), "--live")
    assert status == 0 and dump.count(b"visibility 7 ") == 1 and dump.count(b"probe 7 ") == 1
    items = [(3, struct.pack("<II", 1, 0) + entry(seen)), (2, bytes(16))]
    commit = (6, bytes(16))
    for payload, wanted in (
        (b"", 3101), (probes_record(nothing, flags=2), 3102), (probes_record(block[1:], flags=1), 3101),
        (probes_record(nothing, base=0), 4001), (probes_record(nothing, track_id=8), 2019),
        (probes_record(nothing) + b"\0", 3101), (probes_record(nothing)[:-1], 3101),
        (struct.pack("<4I", 1, 2, 0, 0), 3102), (struct.pack("<4I", 1, 1, 1, 0), 3102), (struct.pack("<4I", 1, 1, 0, 1), 3102),
        (struct.pack("<4I", 1, 1, 0, 0), 3101), (struct.pack("<4I", 0, 1, 0, 0), 0),
    ):
        assert outcome(stream_of(*items, (0x21, payload), commit)) == wanted, payload
    assert outcome(frames_of(raw, [probes_record(nothing, flags=1)])) == 3102
    points = struct.pack("<4I", 1, 1, 0, 0) + struct.pack("<3I", 7, 0, 0)
    assert outcome(stream_of(*items, (0x20, points))) == 2027
    assert outcome(stream_of(*items, (0x21, probes_record(nothing)), (0x20, points))) == 2027
    assert outcome(stream_of(*items, (0x21, probes_record(nothing)), (0x21, probes_record(nothing)))) == 4010
    for limit, wanted in ((184, 2018), (215, 2018), (216, 0)):
        assert outcome(stream_of(items[0]), f"--live --limit state_bytes={limit}") == wanted
    both = ((0x20, struct.pack("<4I", 0, 1, 0, 0)), (0x21, probes_record(nothing)))
    for limit, wanted in ((45, 4009), (46, 0)):
        assert outcome(stream_of(*items, *both, commit), f"--live --limit frame_bytes={limit}") == wanted

def test_questions() -> None:
    """The questions of examples-probes.md, of both interpolations, at the end of its stream."""
    stream, questions = worked("examples-probes.md", "queries")
    assert run(stream) == (0, worked("examples-probes.md", "dump")[1])
    queries, answers = zip(*(line.split(" ; ") for line in questions.decode().splitlines()))
    assert len(queries) == 4
    data = len(stream).to_bytes(4, "little") + stream + "".join(line + "\n" for line in queries).encode()
    status, output = run(data, "--queries")
    lines = output.decode().splitlines()
    assert status == 0 and len(lines) == len(queries)
    for line, wanted in zip(lines, answers):
        for ours, theirs in zip(line.split(), wanted.split(), strict=True):
            assert abs(float(ours) - float(theirs)) <= 0.00005001, (line, wanted)


def directions(rng: random.Random, count: int) -> list[tuple[float, float, float]]:
    return [normalised(tuple(rng.gauss(0, 1) for _ in range(3))) for _ in range(count)]


def test_basis() -> None:
    """Orthonormal, by sums over the sphere; and the first digits, by the table of section 2."""
    sums = [[0.0] * 9 for _ in range(9)]
    rings, sides = 64, 8
    for ring in range(rings):
        z = (ring + 0.5) * 2 / rings - 1
        for side in range(sides):
            angle = (side + 0.5) * 2 * math.pi / sides
            radius = math.sqrt(1 - z * z)
            functions = light.basis((radius * math.cos(angle), radius * math.sin(angle), z))
            for i in range(9):
                for j in range(9):
                    sums[i][j] += functions[i] * functions[j] * 4 * math.pi / (rings * sides)
    for i in range(9):
        for j in range(9):
            assert abs(sums[i][j] - (i == j)) < 0.002, (i, j, sums[i][j])
    x, y, z = 0.48, 0.6, 0.64
    table = (
        0.282095, 0.488603 * y, 0.488603 * z, 0.488603 * x, 1.092548 * x * y, 1.092548 * y * z,
        0.315392 * (3 * z * z - 1), 1.092548 * x * z, 0.546274 * (x * x - y * y),
    )
    assert all(abs(a - b) < 1e-6 for a, b in zip(light.basis((x, y, z)), table, strict=True))


def test_lobe_direction() -> None:
    """[B-079]: the mirror direction, the normal, and in their plane between."""
    rng = random.Random(2)
    for normal, view in zip(directions(rng, 50), directions(rng, 50)):
        mirror = light.lobe_direction(normal, view, 0.0)
        assert abs(dot(mirror, normal) - dot(view, normal)) < 1e-9
        assert abs(dot(mirror, view) - (2 * dot(normal, view) ** 2 - 1)) < 1e-9
        assert dot(light.lobe_direction(normal, view, 1.0), normal) > 1 - 1e-9
        turned = [dot(light.lobe_direction(normal, view, r / 9), mirror) for r in range(10)]
        assert turned == sorted(turned, reverse=True)


def lit(dims: tuple, there: dict[int, probes.Probe], side: int = 0, block: bytes | None = None) -> light.Light:
    return light.Light(volume(RAW, dims, side), probes.Content(there, block))


def grey(value: int) -> probes.Probe:
    """Of degree 0 alone, an f16 as its bits."""
    return probes.Probe(3, (value,) * 3 + (0,) * 24)


def test_interpolation() -> None:
    """Corners, and what each kind of light comes to."""
    rng = random.Random(4)
    same = lit((3, 2, 1), {p: grey(0x3C00) for p in range(6)})
    for normal, view in zip(directions(rng, 60), directions(rng, 60)):
        x = tuple(rng.uniform(-1, 3) for _ in range(3))
        corners = same.corners(x)
        assert abs(sum(t for _, t in corners) - 1) < 1e-12 and all(t >= 0 for _, t in corners)
        # Their mean is the nearest point of the box.
        for axis, size in enumerate((3, 2, 1)):
            mean = sum(t * corner[axis] for corner, t in corners)
            assert abs(mean - min(max(x[axis], 0), size - 1)) < 1e-12
        # Even light: c_0 = 1, so pi times Y_0, and Y_0 itself, wherever one asks.
        for interpolation in light.INTERPOLATIONS:
            irradiance, radiance = same.ask(x, normal, view, rng.random(), interpolation)
            assert all(abs(v - math.pi / math.sqrt(4 * math.pi)) < 1e-9 for v in irradiance)
            assert all(abs(v - 1 / math.sqrt(4 * math.pi)) < 1e-9 for v in radiance)

    x, up, along = (0.5, 0, 0), (0, 1, 0), (1, 0, 0)
    # Of two probes, one before a surface and one behind it: weights of 1.2 and 0.2.
    two = lit((2, 1, 1), {0: grey(0x3C00), 1: grey(0)})
    scale = math.sqrt(math.pi) / 2
    assert abs(two.ask(x, along, up, 0.5, "visibility-weighted")[0][0] - scale * 0.2 / 1.4) < 1e-9
    assert abs(two.ask(x, along, up, 0.5, "trilinear")[0][0] - scale * 0.5) < 1e-9
    # An absent probe counts by its fill to one, and to the other as good as not.
    fill = lit((3, 1, 1), {0: grey(0x3C00), 2: grey(0)})
    assert abs(fill.ask(x, along, up, 0.5, "trilinear")[0][0] - scale * 0.75) < 1e-9
    assert abs(fill.ask(x, along, up, 0.5, "visibility-weighted")[0][0] - scale) < 1e-9
    # And no light is there where no probe is.
    assert lit((2, 1, 1), {}).ask(x, along, up, 0.5, "visibility-weighted") == ([0] * 3, [0] * 3)


def test_maps() -> None:
    """Directions of texels find their texel, and the edges of a map fold as the sphere does."""
    for side in (4, 8, 16):
        block = bytes(v for at in range(side * side) for v in (at % 256, at * 7 % 256))
        seen = lit((1, 1, 1), {0: grey(0x3C00)}, side, block)
        for row in range(side):
            for column in range(side):
                # As the normal of a point, rounded to 16 bits.
                u, v = ((i + 0.5) * 2 / side - 1 for i in (column, row))
                q = octahedral(round(u * 32767), round(v * 32767), 16)
                found = light.octahedral_coordinates(q)
                assert all(abs(a - b) < 1e-4 for a, b in zip(found, (u, v)))
                mean, deviation = seen.texel(0, column, row)
                assert (round(mean * 255), round(deviation * 255)) == tuple(block[2 * (row * side + column) :][:2])
                m, m2 = seen.moments(0, q)
                assert abs(m - mean) < 0.01 and abs(m2 - mean**2 - deviation**2) < 0.02
        last = side - 1
        assert seen.texel(0, -1, 1) == seen.texel(0, 0, last - 1)
        assert seen.texel(0, side, 1) == seen.texel(0, last, last - 1)
        assert seen.texel(0, 2, -1) == seen.texel(0, last - 2, 0)
        assert seen.texel(0, 2, side) == seen.texel(0, last - 2, last)
        assert seen.texel(0, -1, -1) == seen.texel(0, last, last)
        assert seen.texel(0, side, -1) == seen.texel(0, 0, last)
        # Across an edge, and at an axis, moments are those of a step to either side.
        rng = random.Random(side)
        for x, y, z in directions(rng, 40):
            for q, step in (
                ((0, y, -abs(z)), (1e-9, 0, 0)), ((x, 0, -abs(z)), (0, 1e-9, 0)),
                ((x, y, 0), (0, 0, 1e-9)), ((0, 0, -1), (1e-9, 1e-9, 0)),
            ):
                here = seen.moments(0, q)
                for way in (1, -1):
                    there = seen.moments(0, tuple(a + way * b for a, b in zip(q, step)))
                    assert all(abs(a - b) < 1e-6 for a, b in zip(here, there)), (side, q)


def test_share() -> None:
    """[B-076] by hand, and at its edges."""

    def share(mean: int, deviation: int, distance: float) -> float:
        return lit((1, 1, 1), {0: grey(0x3C00)}, 4, bytes((mean, deviation)) * 16).share(0, (0, distance, 0))

    assert share(102, 51, 0) == share(102, 51, 0.4 - 1e-9) == 1  # M = 0.4, V = 0.04
    assert abs(share(102, 51, 0.4 + 1e-9) - 1) < 1e-6
    assert abs(share(102, 51, 0.5) - 0.8**3) < 1e-9  # b = 0.04 / 0.05
    assert abs(share(102, 51, 0.8) - 0.2**3 * (0.2**3 / 0.2) ** 2) < 1e-12  # b = 0.04 / 0.2, crushed
    assert abs(share(51, 0, 0.2 + 1 / 255) - 0.5**3 * (0.5**3 / 0.2) ** 2) < 1e-9  # V at its least
    assert share(255, 0, 9) == share(0, 0, 0) == 1
    assert share(254, 0, 9) < 1e-6


def test_instances_example() -> None:
    """instances.md, section 11: both sections, the digest, and the AO."""
    text = (SPEC / "instances.md").read_text(encoding="utf-8").partition("## 11.")[2]
    sections = [bytes.fromhex(block) for block in re.findall(r"```text\n(.*?)```", text, re.S)]
    mesh = struct.unpack("<6I", struct.pack("<6f", -1, 0, 0, 1, 2, 2))
    two = struct.unpack("<I", struct.pack("<f", 2.0))[0]
    for coding, read, section in zip((RAW, PACKED), (instances.read_raw, instances.read_packed), sections):
        table = Table(1, coding, 0, 0, True, 7, "", mesh, 1, (1, 0), (two, 0), 0, 3, 0, 1024)
        content = instances.Content(read(table, section))
        state = struct.pack("<II48x", 1, 0) + content.digest_bytes()
        assert f"{xxh64(state):016x}" in text
        ao = instances.ambient_occlusion(table, content, "c", (0, 0.5, 1), 0.5)
        assert f"{ao:.4f}" == "0.3594" and "is 0.3594" in text
        assert instances.ambient_occlusion(table, content, "d", (0, 0, 0), 0.5) == 0.5


if __name__ == "__main__":
    for name, test in list(globals().items()):
        if name.startswith("test_"):
            test()
            print(name, "holds")
