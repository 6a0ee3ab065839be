"""Framing: preamble, record headers, payloads, end of input, resuming (container.md)."""

import struct
from typing import NamedTuple

from digest import Xxh64, crc32c
from errors import Fault
from limits import Limits
from packing import ZSTD, lengths_possible, unpack
from session import (
    COMMIT, END, GROUP, MODEL_RECORDS, STREAM, TRACK, TRACK_REMOVE, TRANSFORMS, Observer, Session,
)

MAGIC = b"\x89DPL\r\n\x1a\n"
DEFINED = {STREAM, GROUP, TRACK, TRACK_REMOVE, TRANSFORMS, COMMIT, END, *MODEL_RECORDS}
CRITICAL = 0x8000
HEADER_SIZE = 32
LAST_SEQUENCE = 2**64 - 1


class Header(NamedTuple):
    """A record header (section 2)."""

    type_field: int
    version: int
    packing: int
    reserved: int
    sequence: int
    stored_length: int
    unpacked_length: int
    payload_crc: int
    header_crc: int

    @property
    def type(self) -> int:
        return self.type_field & ~CRITICAL

    @property
    def critical(self) -> bool:
        return bool(self.type_field & CRITICAL)

    @property
    def defined(self) -> bool:
        return self.type in DEFINED


_HEADER = struct.Struct("<HBBIQIIII")


class Decoder:
    """Takes a stream in pieces of any size, and tells an observer what it decodes to.

    `push` raises Fault. After one, nothing more is taken in until `resume` or `reset`
    [C-114]; what came with the fault is kept and goes in after `resume`. `finish`
    raises Fault, too, and changes nothing.
    """

    def __init__(self, limits: Limits, observer: Observer) -> None:
        self.limits = limits
        self.observer = observer
        self.reset()

    def reset(self) -> None:
        """Forget the stream: the next byte starts a preamble."""
        self.session = Session(self.limits, self.observer)
        self.buffer = bytearray()  # what came and was not taken in yet
        self.offset = 0  # of the first byte of the buffer in the stream
        self.preamble_done = False
        self.header: Header | None = None  # of the record whose payload follows
        self.to_skip = 0  # bytes left of a payload that is skipped
        self.ended = False
        self.expected = 0  # the expected sequence
        self.headers_digest = Xxh64()  # of the preamble and the headers so far (section 6.7)
        self.fault: Fault | None = None  # at which the decoder stopped
        self.header_at_fault: tuple[Header, bytes] | None = None  # if it was one of a header
        self.resynchronising = False
        self.resumed = False  # ever: then records may be lost

    # ---- input ----

    def push(self, data: bytes) -> None:
        """The next bytes of the stream."""
        if self.fault is not None:
            raise Fault(4011, self.offset)
        self.keep(data)
        try:
            while self.step():
                pass
        except Fault as fault:
            self.stop(fault)
            raise

    def keep(self, data: bytes) -> None:
        """Bytes that came, to be taken in later."""
        self.buffer += data

    def finish(self, live: bool) -> None:
        """The end of the input [C-103], [C-104]. A question: it changes nothing."""
        if self.fault is not None:
            raise Fault(4011, self.offset)
        if self.ended:
            return
        between_records = (
            self.preamble_done and self.header is None and not self.to_skip and not self.buffer
        )
        if not (live and between_records and self.session.has_stream):
            raise Fault(1019, self.offset + len(self.buffer))
        if self.session.frame is not None:
            raise Fault(4006, self.offset + len(self.buffer))

    def stop(self, fault: Fault) -> None:
        """[C-110]: the open frame is dropped."""
        self.fault = fault
        self.session.drop_frame()

    def step(self) -> bool:
        """Take in one item if all of it is there; says whether to go on."""
        if self.to_skip:
            self.take(min(self.to_skip, len(self.buffer)), skipping=True)
            return not self.to_skip
        if self.ended:
            if self.buffer:
                raise Fault(1020, self.offset)  # [C-102]
            return False
        if not self.preamble_done:
            return self.step_preamble()
        if self.header is None:
            return self.step_header()
        return self.step_payload(self.header)

    def take(self, size: int, skipping: bool = False) -> bytes:
        """The first bytes of the buffer, which leave it."""
        data = bytes(self.buffer[:size])
        del self.buffer[:size]
        self.offset += size
        if skipping:
            self.to_skip -= size
        return data

    # ---- 1. Preamble ----

    def step_preamble(self) -> bool:
        if len(self.buffer) < 16:
            return False
        raw = self.take(16)
        version, profile, crc = struct.unpack_from("<HHI", raw, 8)
        if raw[:8] != MAGIC:  # [C-001]
            raise Fault(1001, 0)
        if crc != crc32c(raw[:12]):  # [C-002]
            raise Fault(1002, 0)
        if version != 1:  # [C-003]
            raise Fault(1003, 0)
        if profile != 0:  # [C-004]
            raise Fault(1004, 0)
        self.headers_digest.update(raw)
        self.preamble_done = True
        return True

    # ---- 2. Record header ----

    def step_header(self) -> bool:
        if len(self.buffer) < HEADER_SIZE:
            return False
        start = self.offset
        raw = self.take(HEADER_SIZE)
        header = Header._make(_HEADER.unpack(raw))
        try:
            self.enter(header, raw)
        except Fault as fault:
            self.header_at_fault = header, raw
            fault.offset = start
            raise
        return True

    def enter(self, header: Header, raw: bytes) -> None:
        """Check a header; then its payload follows, or is skipped."""
        taken_in = self.check_header(header, raw)
        if header.type != END and not self.resumed:
            self.headers_digest.update(raw)
        if taken_in:
            self.header = header
        else:
            self.to_skip = header.stored_length
            self.count(header)

    def check_header(self, header: Header, raw: bytes) -> bool:
        """[C-010] to [C-021]; says whether the record is taken in, or else skipped."""
        if header.header_crc != crc32c(raw[:28]):  # [C-010]
            raise Fault(1005)
        if header.reserved != 0:  # [C-011]
            raise Fault(1006)
        self.check_sequence(header.sequence)  # [C-012], [C-117]
        if header.critical and not header.defined:  # [C-013]
            raise Fault(1022)
        if header.defined and not header.critical:  # [C-014]
            raise Fault(1023)
        if header.defined and header.version != 0:  # [C-015]
            raise Fault(1021)
        if (header.type == STREAM) == self.session.has_stream:  # [C-016]
            raise Fault(4007)
        if not header.defined:  # [C-017]
            if not self.resynchronising:
                self.observer.skipped(header.type, header.sequence)
            return False
        if self.resynchronising and header.type in (TRANSFORMS, COMMIT, *MODEL_RECORDS):  # [C-117]
            return False
        if header.stored_length > self.limits.stored_bytes:  # [C-018]
            raise Fault(1012)
        if header.unpacked_length > self.limits.unpacked_bytes:  # [C-019]
            raise Fault(1013)
        if header.packing > ZSTD:  # [C-020]
            raise Fault(1010)
        if not lengths_possible(header.packing, header.stored_length, header.unpacked_length):
            raise Fault(1014)  # [C-021]
        return True

    def check_sequence(self, sequence: int) -> None:
        if sequence == self.expected or (self.resynchronising and sequence > self.expected):
            return
        if sequence == self.expected - 1:
            raise Fault(1007)
        raise Fault(1008 if sequence > self.expected else 1009)

    def count(self, header: Header) -> None:
        """The record has come: the next sequence is expected (section 2)."""
        self.expected = min(header.sequence + 1, LAST_SEQUENCE)

    # ---- Payload ----

    def step_payload(self, header: Header) -> bool:
        if len(self.buffer) < header.stored_length:
            return False
        start = self.offset
        stored = self.take(header.stored_length)
        self.header = None
        resynchronised = self.resynchronising
        try:
            self.take_payload(header, stored)
        except Fault as fault:
            if header.type != END:  # [C-116], [C-118]: an end with a fault does not count
                self.count(header)
            if resynchronised:
                return True  # [C-118]: not reported
            self.header_at_fault = None
            fault.offset = start
            raise
        self.count(header)
        if header.type == GROUP:  # [C-119]
            self.resynchronising = False
        return True

    def take_payload(self, header: Header, stored: bytes) -> None:
        """[C-112]: the order of the checks of a payload."""
        if header.payload_crc != crc32c(stored):  # [C-022]
            raise Fault(1011)
        if header.type in MODEL_RECORDS:
            self.session.check_model_header(header.unpacked_length)
        payload = unpack(header.packing, stored, header.unpacked_length, self.limits)
        if header.type == END:
            self.take_end(header, payload)
        else:
            self.session.take(header.type, payload)

    # ---- 6.7 end ----

    def take_end(self, header: Header, payload: bytes) -> None:
        if len(payload) != 16:  # [C-040]
            raise Fault(2001)
        count, digest = struct.unpack("<QQ", payload)
        if self.session.frame is not None:  # [C-100]
            raise Fault(4006)
        if not self.resumed:  # [C-101]; no record is lost, so the sequence is their count
            if count != header.sequence:
                raise Fault(1024)
            if digest != self.headers_digest.value():
                raise Fault(1025)
        self.ended = True
        self.observer.end()

    # ---- 8.4 Resume ----

    def resume(self) -> bool:
        """Go on after an error, by resynchronisation at a group; says whether that can be.

        Without an error it is without effect. Then call `push`, with more bytes or none,
        for what is kept.
        """
        if self.fault is None:
            return True
        if self.fault.number in range(1001, 1007) or self.fault.number == 1020:  # [C-115]
            return False
        self.fault = None
        self.resynchronising = True
        self.resumed = True
        if self.header_at_fault is not None:
            header, raw = self.header_at_fault
            self.header_at_fault = None
            try:
                self.enter(header, raw)
            except Fault:
                # [C-116]: skipped without another report; the expected sequence stays.
                self.to_skip = header.stored_length
        return True
