"""Unpacking of payloads (container.md, section 4)."""

import zstandard

from errors import Fault
from limits import Limits

NONE, LZ4, ZSTD = 0, 1, 2

# A match starts so many bytes before the end of the output, or earlier [C-035]...
LZ4_LAST_MATCH = 12
# ...and ends so many before it, or earlier.
LZ4_LAST_LITERALS = 5

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
ZSTD_BLOCK_MAX = 131072
# zstandard takes no larger window than this; our own limit is checked before ([C-032]).
ZSTD_LIBRARY_WINDOW = 2**31


def lengths_possible(packing: int, stored: int, unpacked: int) -> bool:
    """[C-021]: can so many stored bytes unpack to so many?"""
    if packing == NONE:
        return unpacked == stored
    if packing == LZ4:
        return unpacked <= 255 * stored
    return unpacked <= stored // 4 * 131072


def unpack(packing: int, stored: bytes, unpacked_length: int, limits: Limits) -> bytes:
    """The payload that a stored payload unpacks to, of exactly `unpacked_length` bytes."""
    if packing == NONE:
        return stored
    if packing == LZ4:
        return unpack_lz4(stored, unpacked_length)
    return unpack_zstd(stored, unpacked_length, limits)


# ---- lz4 ----


def unpack_lz4(block: bytes, unpacked_length: int) -> bytes:
    """[C-030], [C-035]: one block in the LZ4 block format, error 1015.

    The format is small enough to be read here. The usual library takes more than
    the clauses allow (a match offset of 0, a block that unpacks to less).
    """
    end = len(block)
    at = 0
    out = bytearray()

    def length(nibble: int) -> int:
        """A length of a token: 15 is followed by bytes to be added, up to one that is not 255."""
        nonlocal at
        total = nibble
        more = nibble == 15
        while more:
            if at >= end:
                raise Fault(1015)
            total += block[at]
            more = block[at] == 255
            at += 1
        return total

    while True:
        if at >= end:  # an empty block, or one whose last sequence has a match
            raise Fault(1015)
        token = block[at]
        at += 1

        literals = length(token >> 4)
        if literals > end - at or literals > unpacked_length - len(out):
            raise Fault(1015)
        out += block[at : at + literals]
        at += literals
        if at == end:
            break  # the last sequence ends with its literals
        if end - at < 2:
            raise Fault(1015)

        offset = block[at] | block[at + 1] << 8
        at += 2
        match = length(token & 15) + 4
        if offset == 0 or offset > len(out):
            raise Fault(1015)
        left = unpacked_length - len(out)  # from the start of the match to the end [C-035]
        if left < LZ4_LAST_MATCH or left - match < LZ4_LAST_LITERALS:
            raise Fault(1015)
        pattern = out[len(out) - offset :][:match]  # a short one is repeated
        out += (pattern * (match // len(pattern) + 1))[:match]

    if len(out) != unpacked_length:
        raise Fault(1015)
    return bytes(out)


# ---- zstd ----


def unpack_zstd(frame: bytes, unpacked_length: int, limits: Limits) -> bytes:
    """[C-031] to [C-033]: one plain frame of RFC 8878."""
    blocks_at, window = check_zstd_header(frame, unpacked_length)
    if window > limits.zstd_window_bytes:  # [C-032]
        raise Fault(1018)
    check_zstd_blocks(frame, blocks_at, window)
    try:
        decompressor = zstandard.ZstdDecompressor(max_window_size=ZSTD_LIBRARY_WINDOW)
        # One byte more than is expected, so that too long a frame shows, and no more.
        out = decompressor.stream_reader(frame).read(unpacked_length + 1)
    except zstandard.ZstdError:
        raise Fault(1016) from None
    if len(out) != unpacked_length:  # [C-033]
        raise Fault(1016)
    return out


def check_zstd_header(frame: bytes, unpacked_length: int) -> tuple[int, int]:
    """[C-031], what follows from the frame header. Returns its end, and the window size.

    RFC 8878, 3.1.1.1: magic, Frame_Header_Descriptor, Window_Descriptor unless it is a
    single segment, no Dictionary_ID here, Frame_Content_Size.
    """
    if frame[:4] != ZSTD_MAGIC or len(frame) < 5:
        raise Fault(1017)
    descriptor = frame[4]
    if descriptor & 0x1F:
        raise Fault(1017)
    single_segment = bool(descriptor & 0x20)
    size_flag = descriptor >> 6
    at = 5

    window = 0
    if not single_segment:
        if at >= len(frame):
            raise Fault(1017)
        exponent, mantissa = frame[at] >> 3, frame[at] & 7
        window = 2 ** (10 + exponent) + 2 ** (7 + exponent) * mantissa
        at += 1

    size_bytes = (1 if single_segment else 0, 2, 4, 8)[size_flag]
    if size_bytes == 0 or at + size_bytes > len(frame):
        raise Fault(1017)
    content_size = int.from_bytes(frame[at : at + size_bytes], "little")
    if size_bytes == 2:
        content_size += 256
    at += size_bytes
    if content_size != unpacked_length:
        raise Fault(1017)
    return at, content_size if single_segment else window


def check_zstd_blocks(frame: bytes, at: int, window: int) -> None:
    """[C-031], what follows from the block headers (RFC 8878, 3.1.1.2)."""
    last = False
    while not last:
        if at + 3 > len(frame):
            raise Fault(1017)
        header = int.from_bytes(frame[at : at + 3], "little")
        last = bool(header & 1)
        block_type = header >> 1 & 3
        size = header >> 3
        if block_type == 3 or size > min(ZSTD_BLOCK_MAX, window):
            raise Fault(1017)
        at += 3 + (1 if block_type == 1 else size)  # an RLE block holds one byte
        if at > len(frame):
            raise Fault(1017)
    if at != len(frame):
        raise Fault(1017)
