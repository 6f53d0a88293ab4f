"""Two eyes' videos, or one that holds both side by side, read frame by frame in step."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.video.container import MAX_FRAMES, opened, size_of
from asbuilt_bim.errors import PhotoError
from asbuilt_bim.geometry.arrays import ByteImage

RATE_SHARE = 1e-3
"""By so much two rates differ at most: over a minute that is two frames of sixty a second."""
LEAST_READ = 0.95
"""Of the frames that a video says it has. Fewer: it is damaged, and ends early."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FramePair:
    """Both eyes of one moment, BGR (H, W, 3), as stored; `number` counts from 0."""

    number: int
    left: ByteImage
    right: ByteImage


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoFilm:
    """Where both eyes are: `right` None where one file holds them side by side."""

    left: Path
    right: Path | None

    def rate_and_count(self) -> tuple[float, int]:
        """Return frames a second, and how many frames the file says it has (0: it doesn't).

        Raises:
            PhotoError: a file can't be opened, or the two differ in rate or size.
        """
        film = opened(self.left)
        rate, count = film.get(cv2.CAP_PROP_FPS), int(film.get(cv2.CAP_PROP_FRAME_COUNT))
        if self.right is None:
            if size_of(film)[0] % 2:
                raise PhotoError(f"video {self.left}: {size_of(film)[0]} pixels wide, so it can't hold two eyes")
        else:
            other = opened(self.right)
            if size_of(other) != size_of(film):
                sizes = " and ".join(f"{w} x {h}" for w, h in (size_of(film), size_of(other)))
                raise PhotoError(f"videos {self.left} and {self.right}: frames of {sizes} pixels are of no one rig")
            if abs(other.get(cv2.CAP_PROP_FPS) - rate) > RATE_SHARE * rate:
                raise PhotoError(
                    f"videos {self.left} and {self.right}: {rate:.3f} and {other.get(cv2.CAP_PROP_FPS):.3f} frames a "
                    "second; record both eyes at one rate, triggered together"
                )
        return (rate if np.isfinite(rate) and 1.0 <= rate <= 1000.0 else 30.0), max(count, 0)

    def pairs(self) -> Iterator[FramePair]:
        """Yield every moment, to the end of the videos.

        Raises:
            PhotoError: one video ends before the other, or both before their end; or there are more frames than any
                walk's.
        """
        films = [opened(self.left), *([opened(self.right)] if self.right is not None else [])]
        said = int(films[0].get(cv2.CAP_PROP_FRAME_COUNT))
        number = 0
        while True:
            read = [film.read() for film in films]
            if not all(done for done, _ in read):
                break
            if number >= MAX_FRAMES:
                raise PhotoError(f"video {self.left}: over {MAX_FRAMES:,} frames; cut it into walks")
            images = [np.asarray(image, dtype=np.uint8) for _, image in read]
            half = images[0].shape[1] // 2
            left, right = images if len(images) == 2 else (images[0][:, :half], images[0][:, half:])
            yield FramePair(number=number, left=left, right=right)
            number += 1
        self._check_end(number, said, [done for done, _ in read], films)

    def _check_end(self, number: int, said: int, more: list[bool], films: list[cv2.VideoCapture]) -> None:
        if number == 0:
            raise PhotoError(f"video {self.left}: holds no frame that can be decoded; export it to MP4 again")
        goes_on = [film.grab() for film in films]
        for path, on, read in zip((self.left, self.right), goes_on, more, strict=False):
            if on and not read:
                raise PhotoError(
                    f"video {path}: a frame behind the first {number:,} can't be decoded, so it is damaged; copy it "
                    "from the camera again, or cut the walk before that"
                )
        for path, on in zip((self.left, self.right), goes_on, strict=False):
            if on and any(more):
                raise PhotoError(
                    f"videos {self.left} and {self.right}: one ends after {number:,} frames, and {path} goes on; "
                    "record both eyes triggered together, and cut both alike"
                )
        if number < LEAST_READ * said:
            raise PhotoError(
                f"video {self.left}: ends after {number:,} of {said:,} frames, so it is damaged; copy it from the "
                "camera again"
            )
