"""The limits of a decoder (container.md, section 3). A value equal to a limit is within it."""

from dataclasses import dataclass

MIB = 2**20


@dataclass
class Limits:
    """The default limits, which a stream meant for everyone stays within."""

    stored_bytes: int = 256 * MIB
    unpacked_bytes: int = 256 * MIB
    frame_bytes: int = 512 * MIB
    zstd_window_bytes: int = 8 * MIB
    tracks: int = 65536
    path_bytes: int = 1024
    state_bytes: int = 512 * MIB
