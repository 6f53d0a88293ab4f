"""Damaged photos: which are refused, and which are measured with wrong pixels and without a word.

python benchmarks/hold/photos.py --check            3,000 damaged files of each way to store a photo, some ten minutes
python benchmarks/hold/photos.py --check --quick    120

Photos of the sample are stored as cameras and programs do: JPEG baseline, optimised, progressive, with restart markers,
grey, CMYK, and PNG of 8 and 16 bits. Then bits are turned, bytes lost, pieces exchanged or zeroed, files broken off. A
case counts where OpenCV makes a picture of it with over 2 % of its pixels wrong by over 24 grey levels. Such a picture
must not come through: at most 1 in 100 does. TIFF is refused by its name, since its strips have no check sum.
"""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import simplejpeg
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.camera.photo.read import decode, photo_from_bytes
from asbuilt_bim.errors import PhotoError
from benchmarks.hold.mutate import TORN, mutated
from benchmarks.sites import SAMPLE
from benchmarks.table import Line, line, options, report, told

CASES, QUICK = 3000, 120
WRONG_GREY, WRONG_SHARE = 24, 0.02
MOST_UNSAID = 0.01
Q, RST, PROGRESSIVE = cv2.IMWRITE_JPEG_QUALITY, cv2.IMWRITE_JPEG_RST_INTERVAL, cv2.IMWRITE_JPEG_PROGRESSIVE
JPEG: dict[str, tuple[int, ...]] = {
    "baseline": (Q, 92),
    "optimised": (Q, 80, cv2.IMWRITE_JPEG_OPTIMIZE, 1),
    "progressive": (Q, 92, PROGRESSIVE, 1),
    "restart markers": (Q, 92, RST, 80),
    "progressive, restart markers": (Q, 92, PROGRESSIVE, 1, RST, 80),
    "whole colours": (Q, 95, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444),
}
ByteImage = NDArray[np.uint8]


@dataclass(slots=True)
class Tally:
    """What became of one kind's damaged files."""

    refused: int = 0
    taken: int = 0
    harmful: int = 0  # OpenCV makes a picture of it, and a wrong one
    unsaid: list[str] = field(default_factory=list)  # of these, what came through, and what was done to it


def stored(photo: ByteImage) -> dict[str, bytes]:
    """Return one photo as files, by kind."""
    files = {name: bytes(cv2.imencode(".jpg", photo, list(how))[1]) for name, how in JPEG.items()}
    files["grey"] = bytes(cv2.imencode(".jpg", photo[..., 1], [Q, 92])[1])
    four = np.dstack([photo, np.full(photo.shape[:2], 255, np.uint8)])
    files["CMYK"] = simplejpeg.encode_jpeg(np.ascontiguousarray(four), 92, "CMYK", "444")
    files["PNG"] = bytes(cv2.imencode(".png", photo)[1])
    files["PNG of 16 bits"] = bytes(cv2.imencode(".png", photo.astype(np.uint16) * 257)[1])
    return files


def opencv(data: bytes) -> ByteImage | None:
    """Decode as OpenCV does, without a word."""
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error:
        return None
    return None if image is None else np.asarray(image, dtype=np.uint8)


def is_wrong(image: ByteImage | None, truth: ByteImage) -> bool:
    """Say whether a picture of the photo's size shows something else in over 2 % of its pixels."""
    if image is None or image.shape != truth.shape:
        return False
    off = cv2.absdiff(image, truth).max(axis=2) > WRONG_GREY
    return float(off.mean()) > WRONG_SHARE


def tried(data: bytes, truth: ByteImage, done: str, tally: Tally) -> None:
    """Give one damaged file to the reader, and count what becomes of it."""
    harmful = is_wrong(opencv(data), truth)
    tally.harmful += harmful
    try:
        image = decode(photo_from_bytes("photo", data))
    except PhotoError:
        tally.refused += 1
        return
    tally.taken += 1
    if harmful and is_wrong(image, truth):
        tally.unsaid.append(done)


def lines_of(tallies: dict[str, Tally], sound: list[bool], seconds: dict[str, float], *, quick: bool) -> list[Line]:
    """Return the table."""
    lines = [
        told(f"{name}: wrong pictures without a word", str(len(one.unsaid)), one.harmful)
        for name, one in tallies.items()
    ]
    harmful, unsaid = sum(t.harmful for t in tallies.values()), sum(len(t.unsaid) for t in tallies.values())
    taken = sum(t.taken for t in tallies.values())
    most = f"{MOST_UNSAID:.0%}"
    share = unsaid / max(1, harmful)
    lines.append(line("wrong pictures that come through", f"{share:.2%}", most, harmful, quick or share <= MOST_UNSAID))
    lines.append(told("the same, of all damaged files that are taken", f"{unsaid / max(1, taken):.2%}", taken))
    lines.append(line("sound photos taken", f"{np.mean(sound):.0%}", "all", len(sound), all(sound), least_n=10))
    own, theirs = (seconds[whose] * 1000.0 / len(sound) for whose in ("ours", "opencv"))
    lines.append(told("decoding a photo, beside OpenCV alone (mean)", f"{own:.0f} and {theirs:.0f} ms", len(sound)))
    return lines


def main() -> int:
    """Run it."""
    parser = options(__doc__.partition("\n")[0])
    parser.add_argument("--cases", type=int, default=0, help="damaged files in all")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    cases = args.cases or (QUICK if args.quick else CASES)
    rng = np.random.default_rng(args.seed)
    paths = sorted((SAMPLE / "visits").glob("*/*_left.jpg"))
    paths = [paths[int(k)] for k in rng.permutation(len(paths))[: 1 if args.quick else 6]]
    tallies: dict[str, Tally] = {}
    sound, seconds = list[bool](), {"ours": 0.0, "opencv": 0.0}
    with quiet():
        for path in paths:
            files = stored(np.asarray(cv2.imread(str(path)), dtype=np.uint8))
            for name, data in files.items():
                truth, tally = opencv(data), tallies.setdefault(name, Tally())
                assert truth is not None
                sound.append(_is_taken(data, truth, seconds))
                for _ in range(cases // (len(paths) * len(files))):
                    done, broken = mutated(data, rng, TORN, first=2)
                    tried(broken, truth, done, tally)
    summary: dict[str, object] = {
        "unsaid": dict(Counter(f"{name}: {done}" for name, one in tallies.items() for done in one.unsaid)),
        "refused": {name: one.refused for name, one in tallies.items()},
    }
    return report("Damaged photos", lines_of(tallies, sound, seconds, quick=args.quick), args, summary)


def _is_taken(data: bytes, truth: ByteImage, seconds: dict[str, float]) -> bool:
    """Say whether a sound photo is decoded to OpenCV's pixels, and add what both take."""
    begun = time.process_time()
    opencv(data)
    between = time.process_time()
    try:
        same = bool((decode(photo_from_bytes("photo", data)) == truth).all())
    except PhotoError:
        same = False
    seconds["ours"] += time.process_time() - between
    seconds["opencv"] += between - begun
    return same


class quiet:  # noqa: N801 - reads as a word
    """Send what C libraries print of damage nowhere, while this is entered."""

    def __enter__(self) -> None:
        self._kept = os.dup(2)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 2)
        os.close(nowhere)

    def __exit__(self, *_: object) -> None:
        os.dup2(self._kept, 2)
        os.close(self._kept)


if __name__ == "__main__":
    sys.exit(main())
