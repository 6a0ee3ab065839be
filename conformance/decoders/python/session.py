"""What records do: tracks, groups, frames, commits (container.md, sections 6 and 7).

A record is checked whole before it changes anything, and a frame changes the
committed state at its commit alone [C-090]. `track` and `track remove` take
effect at once; what they leave is of no frame [C-045].
"""

import struct
from dataclasses import dataclass, field
from typing import Protocol

import instances
import points
import probes
import regions
import vertices
from base import Base
from digest import Xxh64
from errors import Fault
from limits import Limits
from payload import Fields
from tracks import (
    INSTANCES, POINTS, PROBES, REGIONS, VERTICES, Declaration, Grid, VertexSet, read_entry,
)

STREAM, GROUP, TRACK, TRACK_REMOVE, TRANSFORMS, COMMIT, END = 1, 2, 3, 4, 5, 6, 7
MODEL_RECORDS = {
    0x20: points.read_points,
    0x21: probes.read_probes,
    0x22: vertices.read_vertices,
    0x23: instances.read_instances,
    0x24: regions.read_regions,
}

Content = (
    points.Content | probes.Content | vertices.Content | instances.Content | regions.Content
)
CONTENTS = {
    POINTS: points.Content,
    PROBES: probes.Content,
    INSTANCES: instances.Content,
    REGIONS: regions.Content,
}

NO_TRANSFORM = bytes(48)


def nothing(declaration: Declaration) -> Content:
    """The content of an empty track."""
    if isinstance(declaration, VertexSet):
        return vertices.Content(declaration.values)
    return CONTENTS[declaration.model]()


@dataclass
class Track:
    """A track, as committed. A removed one stays until the next commit [C-081]."""

    declaration: Declaration
    content: Content
    transform: bytes | None = None  # twelve f32, as they came
    removed: bool = False


@dataclass
class Frame:
    """An open frame: what its commit will change."""

    from_nothing: bool = False  # the first of a group with start 0 [C-062]
    contents: dict[int, Content] = field(default_factory=dict)
    transforms: dict[int, bytes] | None = None  # None: no such record yet
    model_bytes: int = 0  # unpacked, of all model records [B-018]


class Observer(Protocol):
    """Who is told what was decoded, as it comes."""

    def stream(self, ticks: int, seconds: int) -> None: ...
    def group(self, group_id: int, digest: int | None) -> None: ...
    def frame(self, number: int, tick: int, digest: int, tracks: list[Track]) -> None: ...
    def end(self) -> None: ...
    def skipped(self, record_type: int, sequence: int) -> None: ...


class Session:
    """The decoded state, and the records that change it."""

    def __init__(self, limits: Limits, observer: Observer) -> None:
        self.limits = limits
        self.observer = observer
        self.has_stream = False
        self.has_group = False
        self.tracks: dict[int, Track] = {}  # in ascending order of id, since new ids are the highest
        self.highest_id = -1
        self.frame: Frame | None = None
        self.last_frame: int | None = None  # number and tick of the last commit
        self.last_tick = 0

    def live(self, track_id: int) -> Track | None:
        """A track that is declared and not removed since [C-082]."""
        track = self.tracks.get(track_id)
        return None if track is None or track.removed else track

    def live_tracks(self) -> list[Track]:
        return [track for track in self.tracks.values() if not track.removed]

    def drop_frame(self) -> None:
        """[C-110]: what an error does to the open frame."""
        self.frame = None

    def take(self, record_type: int, payload: bytes) -> None:
        """A payload of any defined type but `end`, unpacked."""
        if record_type == STREAM:
            self.take_stream(payload)
        elif record_type == GROUP:
            self.take_group(payload)
        elif record_type == TRACK:
            self.take_track(payload)
        elif record_type == TRACK_REMOVE:
            self.take_track_remove(payload)
        elif record_type == TRANSFORMS:
            self.take_transforms(payload)
        elif record_type == COMMIT:
            self.take_commit(payload)
        else:
            self.take_model(record_type, payload)

    # ---- 6.1 stream ----

    def take_stream(self, payload: bytes) -> None:
        if len(payload) != 8:  # [C-040]
            raise Fault(2001)
        ticks, seconds = struct.unpack("<2I", payload)
        if ticks == 0 or seconds == 0:  # [C-050]
            raise Fault(2003)
        self.has_stream = True
        self.observer.stream(ticks, seconds)

    # ---- 6.2 group ----

    def take_group(self, payload: bytes) -> None:
        if len(payload) != 16:  # [C-040]
            raise Fault(2001)
        group_id, start, digest = struct.unpack("<IIQ", payload)
        if start == 0 and digest != 0:  # [C-041]
            raise Fault(2002)
        if start > 1:  # [C-060]
            raise Fault(2021)
        if self.frame is not None:  # [C-061]
            raise Fault(4006)
        if start == 1:  # [C-063]
            if self.last_frame is None or digest != state_digest(self.tracks):
                raise Fault(4002)
        self.has_group = True
        self.frame = Frame(from_nothing=start == 0)
        self.observer.group(group_id, digest if start == 1 else None)

    # ---- 6.3 track ----

    def take_track(self, payload: bytes) -> None:
        fields = Fields(payload)
        count = fields.u32()
        fields.zero(4)
        new: dict[int, Track] = {}
        highest = self.highest_id
        previous_id = -1
        for _ in range(count):
            entry = read_entry(fields, self.limits)
            if entry.track_id <= previous_id:  # [C-043]
                raise Fault(2004)
            previous_id = entry.track_id
            known = self.live(entry.track_id)
            if known is not None:
                if not entry.same_as(known.declaration):  # [C-075]
                    raise Fault(2006)
                continue  # without effect [C-078]
            if entry.track_id <= highest:  # [C-074]
                raise Fault(2005)
            highest = entry.track_id
            new[entry.track_id] = Track(entry, nothing(entry))
            # Removed tracks count until the commit that ends them [C-076].
            if len(self.tracks) + len(new) > self.limits.tracks:
                raise Fault(2013)
        fields.nothing_left()
        if new:
            self.check_memory([*self.tracks.values(), *new.values()])
        # No fault: the record takes effect [C-077].
        self.tracks.update(new)
        self.highest_id = highest

    def check_memory(self, tracks: list[Track]) -> None:
        """[C-076], error 2018."""
        declarations = [track.declaration for track in tracks]
        grids = [track for track in declarations if isinstance(track, Grid)]
        if (
            sum(track.bucket_count for track in grids) > 2**32 - 1
            or sum(track.cell_capacity for track in grids) > 2**32 - 1
            or sum(track.array_bytes for track in declarations if isinstance(track, VertexSet))
            > 2**32 - 1
            or sum(track.state_bytes for track in declarations) > self.limits.state_bytes
        ):
            raise Fault(2018)

    # ---- 6.4 track remove ----

    def take_track_remove(self, payload: bytes) -> None:
        fields = Fields(payload)
        count = fields.u32()
        ids: list[int] = []
        for _ in range(count):
            track_id = fields.u32()
            if ids and track_id <= ids[-1]:  # [C-043]
                raise Fault(2004)
            if self.live(track_id) is None:  # [C-080]
                raise Fault(2019)
            if self.frame is not None and track_id in self.frame.contents:
                raise Fault(4010)
            ids.append(track_id)
        fields.nothing_left()
        for track_id in ids:
            self.tracks[track_id].removed = True

    # ---- 6.5 transforms ----

    def take_transforms(self, payload: bytes) -> None:
        self.check_group()
        if self.frame is not None and self.frame.transforms is not None:  # [C-086]
            raise Fault(4010)
        fields = Fields(payload)
        count = fields.u32()
        fields.zero(4)
        if len(payload) != 8 + 52 * count:  # [C-040]
            raise Fault(2001)
        transforms: dict[int, bytes] = {}
        previous_id = -1
        for _ in range(count):
            track_id = fields.u32()
            if track_id <= previous_id:  # [C-043]
                raise Fault(2004)
            previous_id = track_id
            start = fields.at
            fields.f32s(12)
            if self.live(track_id) is None:  # [C-085]
                raise Fault(2019)
            transforms[track_id] = payload[start : fields.at]
        self.opened_frame().transforms = transforms

    def check_group(self) -> None:
        """[C-087], of `transforms`, model records and `commit`."""
        if not self.has_group:
            raise Fault(4008)

    def opened_frame(self) -> Frame:
        """The open frame; a `transforms` or model record opens one [C-044]."""
        if self.frame is None:
            self.frame = Frame()
        return self.frame

    # ---- points.md, section 5; probes.md, section 4; vertices.md, section 4; instances.md, section 4; regions.md, section 4 ----

    def check_model_header(self, unpacked_length: int) -> None:
        """What is checked of a model record before it is unpacked [C-112]."""
        self.check_group()
        so_far = self.frame.model_bytes if self.frame is not None else 0
        if so_far + unpacked_length > self.limits.frame_bytes:  # [P-014], [B-018], [I-018]
            raise Fault(4009)

    def take_model(self, record_type: int, payload: bytes) -> None:
        frame = self.frame or Frame()
        base = Base(
            live={
                track_id: (track.declaration, track.content)
                for track_id, track in self.tracks.items()
                if not track.removed
            },
            last_frame=self.last_frame,
            from_nothing=frame.from_nothing,
            in_frame=set(frame.contents),
        )
        contents = MODEL_RECORDS[record_type](payload, base)
        frame = self.opened_frame()
        frame.contents.update(contents)
        frame.model_bytes += len(payload)

    # ---- 6.6 commit ----

    def take_commit(self, payload: bytes) -> None:
        if len(payload) < 16:  # [C-040]
            raise Fault(2001)
        tick, number, has_digest = struct.unpack_from("<QII", payload)
        if has_digest > 1:  # [C-041]
            raise Fault(2002)
        if len(payload) != 16 + 8 * has_digest:  # [C-040]
            raise Fault(2001)
        self.check_group()
        if self.last_frame is not None:
            if number <= self.last_frame:  # [C-091]
                raise Fault(4003)
            if tick < self.last_tick:  # [C-092]
                raise Fault(4004)

        tracks = self.state_after(self.frame or Frame())
        digest = state_digest(tracks)
        if has_digest and digest != int.from_bytes(payload[16:], "little"):  # [C-093]
            raise Fault(4005)

        self.tracks = tracks
        self.frame = None
        self.last_frame = number
        self.last_tick = tick
        self.observer.frame(number, tick, digest, list(tracks.values()))

    def state_after(self, frame: Frame) -> dict[int, Track]:
        """The tracks as the commit of a frame leaves them."""
        after: dict[int, Track] = {}
        transforms = frame.transforms or {}
        for track_id, track in self.tracks.items():
            if track.removed:  # [C-081]
                continue
            content = nothing(track.declaration) if frame.from_nothing else track.content  # [C-062]
            transform = None if frame.from_nothing else track.transform
            after[track_id] = Track(
                track.declaration,
                frame.contents.get(track_id, content),
                transforms.get(track_id, transform),
            )
        return after


def state_digest(tracks: dict[int, Track]) -> int:
    """[C-105]: the digest of a state."""
    hasher = Xxh64()
    for track_id, track in tracks.items():  # in ascending order of id
        has_transform = track.transform is not None
        hasher.update(struct.pack("<II", track_id, has_transform))
        hasher.update(track.transform if has_transform else NO_TRANSFORM)
        hasher.update(track.content.digest_bytes())
    return hasher.value()
