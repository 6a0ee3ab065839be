"""Holds two decoders against each other over streams with faults and recomputed checksums.

    differ.py --vectors FOLDER [--cases N] [--seed S] [--keep FOLDER] DECODER DECODER

DECODER is a command that speaks the protocol of the conformance suite; `--batch` is
appended to it. Each case takes a stream of the vectors, puts one to three faults into
it (a bit, a byte, a word, a field of a header, a packed payload, a record lost, twice,
out of place or of another stream), recomputes checksums, sequences and totals so that the fault is met where
it lies and not before, and asks both decoders, as a stream or as a session that resumes.
Status and output, with id and offset of an error, must be the same. Exit code 1 where
the decoders differ. The same arguments give the same cases, given the same libraries of
`python/requirements.txt`, which pack some of the payloads.
"""

import argparse
import collections
import random
import struct
import subprocess
import sys
from pathlib import Path

import lz4.block
import zstandard

sys.path.insert(0, str(Path(__file__).parent / "python"))

from digest import Xxh64, crc32c

PREAMBLE, HEADER = 16, 32
POINTS, END = 0x8020, 0x8007
# Words at which something begins or ends.
WORDS = (0, 1, 2, 3, 7, 8, 12, 16, 0xFF, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000,
         0x7F800000, 0x80000001, 0xFFFFFFFE, 0xFFFFFFFF)
TYPES = (*range(0x8000, 0x8009), POINTS, 0x0020, 0x0001, 0x0010, 0x8010, 0x8021, 0x7000, 0xF000)
# Small, so that a case takes no time; both decoders are told.
LIMITS = {"state_bytes": 1 << 20, "unpacked_bytes": 1 << 18, "frame_bytes": 1 << 18}


class Record:
    """A record's fields as they are to be written, right or wrong."""

    def __init__(self, header: bytes, payload: bytes) -> None:
        (self.type, self.version, self.packing, self.reserved, self.sequence, self.stored,
         self.unpacked, self.crc) = struct.unpack("<HBBIQIII", header[:28])
        self.payload = payload
        self.recompute_header = True

    def copy(self) -> "Record":
        return Record(self.to_bytes()[:HEADER], self.payload)

    def recompute_payload(self) -> None:
        """The lengths and the checksum of what the payload is now."""
        if self.packing == 0:
            self.unpacked = len(self.payload)
        self.stored = len(self.payload)
        self.crc = crc32c(self.payload)

    def to_bytes(self) -> bytes:
        head = struct.pack("<HBBIQIII", self.type, self.version, self.packing, self.reserved,
                           self.sequence, self.stored, self.unpacked, self.crc)
        return head + struct.pack("<I", crc32c(head)) + self.payload


def parse(stream: bytes) -> list[Record] | None:
    """The records of a stream whose framing holds."""
    records, at = [], PREAMBLE
    while at < len(stream):
        header = stream[at : at + HEADER]
        if len(header) < HEADER:
            return None
        size = int.from_bytes(header[16:20], "little")
        payload = stream[at + HEADER : at + HEADER + size]
        if len(payload) < size:
            return None
        records.append(Record(header, payload))
        at += HEADER + size
    return records


# ---- Faults ----


def damage(rng: random.Random, data: bytes) -> bytes:
    """A bit, byte or word of the data, or its length, is changed."""
    out = bytearray(data)
    how = rng.randrange(10)
    if not out or how == 0:
        at = rng.randrange(len(out) + 1)
        out[at:at] = rng.randbytes(rng.choice((1, 4, 12)))
    elif how == 1:
        at = rng.randrange(len(out))
        del out[at : at + rng.choice((1, 4, 12))]
    elif how <= 4:
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    elif how == 5:
        out[rng.randrange(len(out))] = rng.choice((0, 1, 2, 0x7F, 0x80, 0xFF, rng.randrange(256)))
    elif len(out) >= 4:
        at = rng.randrange(len(out) // 4) * 4
        old = int.from_bytes(out[at : at + 4], "little")
        near = (old + rng.choice((-1, 1))) % 2**32
        other = rng.randrange(len(out) // 4) * 4
        copied = int.from_bytes(out[other : other + 4], "little")
        word = rng.choice((near, copied, rng.choice(WORDS), rng.randrange(12)))
        out[at : at + 4] = struct.pack("<I", word)
    return bytes(out)


def literals(size: int) -> bytes:
    """Token and length bytes of an lz4 sequence of literals."""
    if size < 15:
        return bytes([size << 4])
    return b"\xf0" + b"\xff" * ((size - 15) // 255) + bytes([(size - 15) % 255])


def pack(rng: random.Random, record: Record) -> None:
    """Packs a plain payload: by a library, as literals, or as raw blocks with a window or none."""
    data = record.payload
    record.unpacked = len(data)
    how = rng.randrange(6)
    record.packing = 1 if how < 2 else 2
    if how == 0:
        record.payload = lz4.block.compress(data, store_size=False)
        return
    if how == 1:
        record.payload = literals(len(data)) + data
        return
    if how < 5:
        compressor = zstandard.ZstdCompressor(level=rng.choice((1, 3, 9, 19)))
        record.payload = compressor.compress(data)
        return
    single = rng.random() < 0.6
    head = b"\x28\xb5\x2f\xfd" + bytes([0xA0 if single else 0x80])
    if not single:
        head += bytes([rng.randrange(24)])
    head += struct.pack("<I", len(data))
    cut = rng.randrange(len(data) + 1)
    first, second = data[:cut], data[cut:]
    blocks = struct.pack("<I", len(first) << 3)[:3] + first
    blocks += struct.pack("<I", len(second) << 3 | 1)[:3] + second
    record.payload = head + blocks


def fault(rng: random.Random, records: list[Record], others: list[Record]) -> str:
    """Puts one fault into the records, or a record of `others`. Returns its kind."""
    which = rng.randrange(len(records))
    record = records[which] = records[which].copy()
    how = rng.randrange(23)
    if how < 10:
        if rng.random() < 0.3 and record.packing == 0:
            pack(rng, record)
        record.payload = damage(rng, record.payload)
        record.recompute_payload()
        return f"payload {record.packing}"
    if how == 10 and record.packing == 0:
        pack(rng, record)
        record.recompute_payload()
        return f"packed {record.packing}"
    if how == 11:
        record.type = rng.choice(TYPES)
        return "type"
    if how == 12:
        field = rng.choice(("version", "packing", "reserved", "crc", "stored", "unpacked"))
        top = 256 if field in ("version", "packing") else 2**32
        value = getattr(record, field)
        value = rng.choice((value ^ 1 << rng.randrange(8), value + 1, value - 1, rng.randrange(4)))
        setattr(record, field, value % top)
        return field
    if how == 13:
        shift = rng.choice((-2, -1, 1, 2, 5, 2**63, -(2**63)))
        for later in range(which, len(records) if rng.random() < 0.5 else which + 1):
            records[later] = records[later].copy()
            records[later].sequence = (records[later].sequence + shift) % 2**64
        return "sequence"
    if how == 14:
        record.sequence = rng.choice((0, 2**64 - 1, 2**64 - 2, 2**63))
        return "sequence"
    if how == 15 and len(records) > 1:
        del records[which]
        return "lost"
    if how == 16:
        records.insert(rng.randrange(len(records) + 1), record.copy())
        return "twice"
    if how == 17:
        record.payload = b""
        record.recompute_payload()
        return "empty"
    if how <= 19:
        at = rng.randrange(len(records) + 1)
        first = rng.randrange(len(others))
        records[at:at] = [other.copy() for other in others[first : first + rng.choice((1, 1, 3))]]
        return "spliced"
    other = rng.randrange(len(records))
    records[which], records[other] = records[other], records[which]
    return "swapped"


def renumber(records: list[Record]) -> None:
    """Sequences from 0."""
    for sequence, record in enumerate(records):
        records[sequence] = record.copy()
        records[sequence].sequence = sequence


def written(rng: random.Random, preamble: bytes, records: list[Record], recompute_end: bool) -> bytes:
    """The stream; where there is an `end`, its totals are recomputed."""
    out = bytearray(preamble)
    digest = Xxh64()
    digest.update(preamble)
    for at, record in enumerate(records):
        if record.type == END and record.packing == 0 and len(record.payload) == 16 and recompute_end:
            record = record.copy()
            record.payload = struct.pack("<QQ", at, digest.value())
            record.crc = crc32c(record.payload)
        data = record.to_bytes()
        digest.update(data[:HEADER])
        out += data
    return bytes(out)


def boundaries(stream: bytes) -> list[int]:
    """Where the preamble, headers and payloads end, as far as the framing holds."""
    found, at = [PREAMBLE], PREAMBLE
    while at + HEADER <= len(stream):
        size = int.from_bytes(stream[at + 16 : at + 20], "little")
        found += [at + HEADER, at + HEADER + size]
        at += HEADER + size
    return [end for end in found if end <= len(stream)] or [len(stream)]


def script(rng: random.Random, stream: bytes) -> bytes:
    """A session that takes the stream in pieces and goes on after each fault."""
    steps = [b"resume", b"finish", b"finish-live", b"reset"]
    out, at = b"", 0
    ends = boundaries(stream)
    some = rng.random() < 0.5  # cut where something ends, or anywhere
    while at < len(stream):
        later = [end for end in ends if end > at] or [len(stream)]
        end = rng.choice(later) if some else rng.randrange(at + 1, len(stream) + 1)
        piece = stream[at : rng.choice((end, end, len(stream)))]
        out += b"push %d\n" % len(piece) + piece
        at += len(piece)
        for _ in range(rng.choice((0, 1, 1, 2, 4))):
            out += rng.choices(steps, (20, 3, 6, 1))[0] + b"\n"
    return out + b"resume\n" * rng.randrange(4) + b"finish-live\nfinish\n"


# ---- The decoders ----


class Program:
    """A decoder that is asked in batch; started again where it died."""

    def __init__(self, command: str) -> None:
        self.command = command
        self.process: subprocess.Popen[bytes] | None = None

    def ask(self, words: str, data: bytes) -> tuple[int, bytes]:
        if self.process is None or self.process.poll() is not None:
            self.process = subprocess.Popen(
                self.command + " --batch", shell=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
            )
        stdin, stdout = self.process.stdin, self.process.stdout
        assert stdin and stdout
        try:
            stdin.write(struct.pack("<I", len(words)) + words.encode())
            stdin.write(struct.pack("<I", len(data)) + data)
            stdin.flush()
            status, size = struct.unpack("<BI", stdout.read(5))
            return status, stdout.read(size)
        except (struct.error, BrokenPipeError):
            self.process.wait()
            self.process = None
            return -1, b"died\n"


def streams(folder: Path) -> list[tuple[str, bytes]]:
    """The streams of the vectors, valid and not, that are small and framed."""
    found = []
    for path in sorted(folder.glob("*/*/*.dapple")):
        data = path.read_bytes()
        if path.parent.name in ("valid", "invalid", "limits") and len(data) <= 8192:
            found.append((str(path.relative_to(folder)), data))
    return found


def ending(output: bytes) -> str:
    """What the last line says, without numbers that differ from case to case."""
    last = output.decode(errors="replace").splitlines()[-1:] or ["nothing"]
    return last[0].partition(',"offset"')[0].split(" ")[0]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--vectors", type=Path, required=True)
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="where the cases that differ are written")
    parser.add_argument("decoder", nargs=2)
    options = parser.parse_args()

    rng = random.Random(options.seed)
    sources = streams(options.vectors)
    good = [source for source in sources if "/valid/" in source[0]]
    programs = [Program(command) for command in options.decoder]
    outcomes: collections.Counter[str] = collections.Counter()
    differences: collections.Counter[str] = collections.Counter()
    cases = 0
    while cases < options.cases:
        name, stream = rng.choice(good if rng.random() < 0.8 else sources)
        records = parse(stream)
        if not records:
            continue
        others = parse(rng.choice(good)[1]) or records
        cases += 1
        kinds = [fault(rng, records, others) for _ in range(rng.choice((1, 1, 1, 2, 3)))]
        if rng.random() < 0.7 and "sequence" not in kinds:
            renumber(records)
        data = written(rng, stream[:PREAMBLE], records, rng.random() < 0.9)
        if rng.random() < 0.03:
            data += rng.randbytes(rng.randrange(1, 40))
        if rng.random() < 0.03:
            data = data[: rng.choice((rng.randrange(len(data) + 1), rng.choice(boundaries(data))))]
        limits = dict(LIMITS)
        if rng.random() < 0.05:
            limits["tracks"] = rng.randrange(3)
            limits["zstd_window_bytes"] = rng.choice((0, 1024, 65536))
            limits["frame_bytes"] = rng.choice((16, 100, 400))
            limits["path_bytes"] = rng.randrange(8)
            limits["stored_bytes"] = rng.choice((8, 200, 2**32 - 1))
            limits["state_bytes"] = rng.choice((100, 1000, 10_000))
        words = " ".join(f"--limit {key}={value}" for key, value in limits.items())
        if rng.random() < 0.25:
            words += " --session"
            data = script(rng, data)
        else:
            words += rng.choice(("", "", "", " --live", " --partial"))
        words += rng.choice(("", "", " --pieces 1", " --pieces 33"))
        first, second = [program.ask(words, data) for program in programs]
        outcomes[f"{first[0]} {ending(first[1])}"] += 1
        if first == second:
            continue
        kind = (f"{'session ' if '--session' in words else ''}{'+'.join(kinds)}: "
                f"{first[0]} {ending(first[1])} / {second[0]} {ending(second[1])}")
        differences[kind] += 1
        if options.keep and differences[kind] <= 3:
            base = options.keep / f"{options.seed}-{cases}"
            options.keep.mkdir(parents=True, exist_ok=True)
            base.with_suffix(".dapple").write_bytes(data)
            base.with_suffix(".txt").write_bytes(
                f"{name}\n{kind}\n{words}\n\n".encode() + first[1] + b"\n----\n" + second[1]
            )
    for outcome, count in sorted(outcomes.items()):
        print(f"{count:8} {outcome}")
    print(f"{cases} cases, {len(outcomes)} outcomes, {sum(differences.values())} differences")
    for kind, count in differences.most_common():
        print(f"{count:8} {kind}")
    return 1 if differences else 0


if __name__ == "__main__":
    sys.exit(main())
