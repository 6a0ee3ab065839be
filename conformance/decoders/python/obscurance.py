"""What baked models share (obscurance.md)."""

import struct

from tracks import Baked


def f32(bits: int) -> float:
    """The f32 with these bits."""
    return struct.unpack("<f", struct.pack("<I", bits))[0]


def blend(track: Baked, signals: list[float]) -> float:
    """[O-010]"""
    if track.signals == 1:
        return signals[0]
    a, b = signals
    return a + (b - a) * f32(track.share)
