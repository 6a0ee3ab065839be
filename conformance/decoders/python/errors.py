"""Faults of a stream: the numbers of README.md, "Errors"."""

LAYERS = {1: "framing", 2: "record", 3: "codec", 4: "session"}


class Fault(Exception):
    """A stream breaks a clause.

    The code that finds a fault knows its number. The offset [C-113] is known to
    container.py alone, which fills it in before the fault leaves the decoder.
    """

    def __init__(self, number: int, offset: int = -1) -> None:
        super().__init__(number, offset)
        self.number = number
        self.offset = offset

    @property
    def layer(self) -> str:
        """The first digit of the number names the layer."""
        return LAYERS[self.number // 1000]
