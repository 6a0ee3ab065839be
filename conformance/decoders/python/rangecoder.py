"""The adaptive binary range coder of packed content (probes.md, section 6.2)."""

from errors import Fault


class RangeDecoder:
    """Bits out of a section's part. Bytes beyond its end are 0.

    `starts` has the numbers at which contexts start; `error` is the model's for bytes that end too early or late.
    """

    def __init__(self, data: bytes, starts: bytes, error: int) -> None:
        self.data = data
        self.error = error
        self.taken = 0  # bytes, those beyond the end too
        self.range = 2**32 - 1
        self.code = 0
        for _ in range(4):
            self.code = self.code << 8 | self.next_byte()
        if self.code >= self.range:  # [B-035]
            raise Fault(self.error)
        self.estimates = [256 * start + 128 for start in starts]  # [B-033]

    def next_byte(self) -> int:
        byte = self.data[self.taken] if self.taken < len(self.data) else 0
        self.taken += 1
        return byte

    def bounded(self, bound: int) -> int:
        """[B-030]"""
        if self.code < bound:
            bit = 0
            self.range = bound
        else:
            bit = 1
            self.code -= bound
            self.range -= bound
        while self.range < 2**24:
            self.range <<= 8
            self.code = self.code << 8 | self.next_byte()
        return bit

    def bit(self, context: int) -> int:
        """[B-031]: a bit in a context, which is adapted."""
        q = self.estimates[context]
        bit = self.bounded((self.range >> 16) * q)
        self.estimates[context] = q - (q >> 5) if bit else q + ((65536 - q) >> 5)
        return bit

    def even(self) -> int:
        """[B-032]"""
        return self.bounded(self.range >> 1)

    def finish(self) -> None:
        """[B-034]"""
        if not len(self.data) <= self.taken <= len(self.data) + 4:
            raise Fault(self.error)
