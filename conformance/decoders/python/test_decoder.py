"""Tests: the worked example and what is built from it. Run with `python test_decoder.py SPEC_FOLDER`."""

import io
import random
import re
import struct
import sys
from pathlib import Path

import lz4.block
import zstandard

from decoder import answer, read_options
from digest import crc32c, xxh64
from errors import Fault
from limits import Limits
from packing import unpack_lz4, unpack_zstd
from sampling import octahedral

SPEC = Path(sys.argv[1])


def example() -> tuple[bytes, bytes]:
    """The stream of examples.md and its dump."""
    text = (SPEC / "examples.md").read_text(encoding="utf-8")
    stream = bytearray()
    for block in re.findall(r"```hex\n(.*?)```", text, re.S):
        for line in block.splitlines():
            stream += bytes.fromhex(line.split(";")[0])
    return bytes(stream), re.search(r"```dump\n(.*?)```", text, re.S)[1].encode()


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

    But in the payload of the record that is skipped, which nothing is held to [C-017].
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
    assert unpack_lz4(b"\x14A\1\0\0", 9) == b"A" * 9


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
    assert fault_of(unpack_zstd, magic + b"\x20\0\x2d\0\0\xff\xff\xff\xff\xff", 0, limits) == 1016
    assert fault_of(unpack_zstd, magic + b"\x20\0\x09\0\0A", 0, limits) == 1016
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
    # The first commit is lost: the delta's header is a gap; the search ends at the
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
    """At the first point of cube (1, 0, 2) of the last frame, which has AO 203; all normals up."""
    stream, _ = example()
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


if __name__ == "__main__":
    for name, test in list(globals().items()):
        if name.startswith("test_"):
            test()
            print(name, "holds")
