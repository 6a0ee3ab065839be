"""What a model record is checked against, and the checks that the models share (points.md 5, probes.md 4)."""

from dataclasses import dataclass
from typing import Any

from errors import Fault
from tracks import Declaration


@dataclass
class Base:
    """The state before a model record."""

    live: dict[int, tuple[Declaration, Any]]  # the live tracks, each with its committed content
    last_frame: int | None  # number of the last commit
    from_nothing: bool  # the frame is the first of a group that starts from keyframes
    in_frame: set[int]  # tracks that the frame has content for already

    def check_frame(self, keyframe: bool, base_frame: int) -> None:
        """[P-012], [B-015]."""
        if not keyframe and (self.from_nothing or base_frame != self.last_frame):
            raise Fault(4001)

    def named(self, track_id: int, previous_id: int, model: int) -> tuple[Any, Any]:
        """[P-013], [B-016], [B-017]: a track by its id in a table, and its committed content."""
        if track_id <= previous_id:
            raise Fault(2004)
        if track_id not in self.live:
            raise Fault(2019)
        declaration, content = self.live[track_id]
        if declaration.model != model:  # [B-017]
            raise Fault(2027)
        if track_id in self.in_frame:
            raise Fault(4010)
        return declaration, content
