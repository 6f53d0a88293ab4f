"""The frames of a walk that become stations: sharp ones, each showing half of what the one before showed."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.photo.exif import tiff_of_day
from asbuilt_bim.camera.photo.picture_file import png_with_exif
from asbuilt_bim.camera.video.motion import (
    followed,
    frames_behind,
    points_of,
    sharpness,
    small_grey,
    whole_shift,
)
from asbuilt_bim.camera.video.stereo_film import FramePair, StereoFilm
from asbuilt_bim.errors import PhotoError
from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray

LEAST_OVERLAP = 0.5
"""Of what a station shows, the next one still shows: then every place is in two stations, which links them."""
SPARE = 0.15
"""So much earlier than needed a frame may be taken, where it is sharper."""
STILL = 0.9
"""The first station is the sharpest frame that shows so much of what the first frame does."""
LOOKS_A_SECOND = 12.0
"""Points are followed so often: a turn of 90 degrees a second moves them by a tenth of the frame."""
MAX_STATIONS = 1_000
MAX_KEPT = 200
"""Small frames held since the last choice; of more, every second one is enough to follow points through."""
_SYNC_WIDTH_PX, _SYNC_SECONDS, _SYNC_LAG_S = 160, 40.0, 0.5
PROGRESS = "progress"


@dataclass(frozen=True, slots=True, kw_only=True)
class TakenFrame:
    """A frame that became a station: its number in the video, and the names of its two pictures."""

    number: int
    left: str
    right: str


@dataclass(slots=True, kw_only=True, eq=False)
class _Walk:
    """What was seen since the last station: points of it that are still in view, and the sharpest frame to take."""

    points: Float32Array
    counted: int
    last: ByteImage
    best: FramePair | None = None
    best_sharp: float = -1.0
    small: list[ByteImage] = field(default_factory=list)  # from the best frame on
    steady: bool = True  # the last two looks show the same, or it didn't matter

    @property
    def overlap(self) -> float:
        """Return the share of the last station's points that are still in view; 0 where it had none."""
        return len(self.points) / self.counted if self.counted else 0.0

    def look(self, grey: ByteImage) -> None:
        """Follow the points into the next frame."""
        self.points = followed(self.last, grey, self.points)
        self.steady = self.overlap >= LEAST_OVERLAP or self.best is not None or _same(self.last, grey)
        self.last = grey
        if self.best is not None:
            self.small.append(grey)
            if len(self.small) > MAX_KEPT:
                self.small = [self.small[0], *self.small[1:-1:2], self.small[-1]]

    def offer(self, pair: FramePair, grey: ByteImage) -> None:
        """Keep a frame, if it is the sharpest since the last station that may be taken."""
        sharp = min(sharpness(pair.left), sharpness(pair.right))
        if sharp > self.best_sharp:
            self.best, self.best_sharp, self.small = _copied(pair), sharp, [grey]

    def begin_again(self) -> None:
        """Take up the points of the frame that was chosen, and follow them to where the walk is now."""
        self.points = points_of(self.small[0])
        self.counted = len(self.points)
        for before, after in zip(self.small, self.small[1:], strict=False):
            self.points = followed(before, after, self.points)
        self.best, self.best_sharp, self.small = None, -1.0, []


def _same(before: ByteImage, after: ByteImage) -> bool:
    """Say whether two looks show the same: of a covered lens, darkness or a blur nothing can be followed."""
    points = points_of(before)
    return len(followed(before, after, points)) > LEAST_OVERLAP * len(points)


def _copied(pair: FramePair) -> FramePair:
    return FramePair(number=pair.number, left=pair.left.copy(), right=pair.right.copy())


def take_frames(
    left: str, right: str, folder: str, name: str, taken_on: date | None = None
) -> tuple[TakenFrame, ...]:  # fmt: skip
    """Write the frames of a walk that become stations into a folder, as PNG; `right` "" is both eyes in one video.

    Their EXIF says the day that they were `taken_on`, if it is known.
    Runs in a process of its own: a video is other people's file. How far it is stands in the folder's file `progress`.

    Raises:
        PhotoError: the videos can't be used; the text says why and what to do.
    """
    film = StereoFilm(left=Path(left), right=Path(right) if right else None)
    rate, count = film.rate_and_count()
    step = max(1, round(rate / LOOKS_A_SECOND))
    walk: _Walk | None = None
    taken: list[TakenFrame] = []
    sync = _Sync()
    exif = tiff_of_day(taken_on) if taken_on else b""
    for pair in film.pairs():
        if right:
            sync.look(pair)
        if pair.number % step:
            continue
        if pair.number // step % 5 == 0:
            _tell(Path(folder), pair.number, count)
        grey = small_grey(pair.left)
        if walk is None or not walk.counted:
            points = points_of(grey)
            walk = _Walk(points=points, counted=len(points), last=grey)
        else:
            walk.look(grey)
        if _chosen(walk, pair, grey, first=not taken):
            taken.append(_write(walk, Path(folder), name, len(taken) + 1, exif))
    if right:
        _check_together(film, sync, rate)
    if walk is not None and walk.best is not None and (not taken or walk.overlap < 1.0 - SPARE):
        taken.append(_write(walk, Path(folder), name, len(taken) + 1, exif))
    return tuple(taken)


def _chosen(walk: _Walk, pair: FramePair, grey: ByteImage, *, first: bool) -> bool:
    """Offer a frame, and say whether the sharpest so far is to be taken now."""
    if first:
        if walk.overlap >= STILL or walk.best is None:
            walk.offer(pair, grey)
            return False
        return True
    if walk.steady and walk.overlap < LEAST_OVERLAP + SPARE and (walk.overlap >= LEAST_OVERLAP or walk.best is None):
        walk.offer(pair, grey)
    return walk.best is not None and walk.overlap < LEAST_OVERLAP


def _write(walk: _Walk, folder: Path, name: str, number: int, exif: bytes) -> TakenFrame:
    """Write the chosen frame's two pictures, and go on from it."""
    if number > MAX_STATIONS:
        raise PhotoError(f"video {name}: over {MAX_STATIONS:,} stations; cut it into walks of some minutes")
    pair = walk.best
    assert pair is not None
    names = [f"{name}_{number:04d}_{side}.png" for side in ("left", "right")]
    for file, image in zip(names, (pair.left, pair.right), strict=True):
        done, data = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 3])
        if not done:
            raise PhotoError(f"video {name}: frame {pair.number} can't be written as PNG")
        png = data.tobytes()
        (folder / file).write_bytes(png_with_exif(png, exif) if exif else png)
    walk.begin_again()
    return TakenFrame(number=pair.number, left=names[0], right=names[1])


def _tell(folder: Path, done: int, count: int) -> None:
    (folder / PROGRESS).write_text(f"{done} {count}", encoding="ascii")


@dataclass(slots=True, kw_only=True, eq=False)
class _Sync:
    """How both eyes moved from frame to frame."""

    last: tuple[Float32Array, Float32Array] | None = None
    moves: list[tuple[tuple[float, float], tuple[float, float]]] = field(default_factory=list)

    def look(self, pair: FramePair) -> None:
        """Note one frame's motion."""
        left, right = (small_grey(one, _SYNC_WIDTH_PX).astype(np.float32) for one in (pair.left, pair.right))
        if self.last is not None:
            self.moves.append((whole_shift(self.last[0], left), whole_shift(self.last[1], right)))
        self.last = left, right


def _check_together(film: StereoFilm, sync: _Sync, rate: float) -> None:
    """See that both eyes moved at one time, all along the walk: an eye that loses frames is early from there on.

    Raises:
        PhotoError: one runs behind the other.
    """
    both: FloatArray = np.array(sync.moves, dtype=np.float64).reshape(-1, 2, 2)
    span = int(_SYNC_SECONDS * rate)
    last = max(0, len(both) - span)
    for first in (*range(0, last, max(1, span // 2)), last):
        part = both[first : first + span]
        behind = frames_behind(part[:, 0], part[:, 1], max(1, round(_SYNC_LAG_S * rate)))
        if not behind:
            continue
        late, early = (film.right, film.left) if behind > 0 else (film.left, film.right)
        mend = f"cut the walk before that, where {early} lost some" if first else "cut what the late one has more there"
        raise PhotoError(
            f"video {late}: runs {abs(behind)} frames ({abs(behind) / rate * 1e3:.0f} ms) behind {early} from "
            f"{first / rate:.0f} s on, so their frames are no pairs; record both eyes triggered together, or {mend}"
        )


def station_names(taken: Sequence[TakenFrame]) -> list[str]:
    """Return the stations' names: what their two pictures' names have in common."""
    return [frame.left.removesuffix("_left.png") for frame in taken]
