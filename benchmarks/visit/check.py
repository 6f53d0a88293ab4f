"""Does a check on site name what is wrong with photos, and say nothing of good ones; and what does it cost?

python benchmarks/visit/check.py --check --json figures.json     the sample's stations, each fault 20 times
python benchmarks/visit/check.py --quick                          each fault three times, one station timed

Faults are put into the sample's own photos, drawn by a fixed seed: how much, on which side, at which station. Half of
the exchanged pairs have lost their EXIF. Time is processor time of one thread: the check of a station beside its
measurement, in one run, decoding included in both.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.camera.photo.read import Photo, photo_from_bytes
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason
from asbuilt_bim.flow.check_places import PlacedBy
from asbuilt_bim.flow.check_visit import checked_visit, sighted
from asbuilt_bim.flow.measure_visit import options_of, read_pair
from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.flow.visit_plan import planned_design
from asbuilt_bim.ifc.apart import read_floors
from asbuilt_bim.measure.station import MeasureOptions, StationPhotos, measure_station
from asbuilt_bim.progress.completion.wanted_views import begun_by
from asbuilt_bim.progress.visits.checked import CheckedStation
from asbuilt_bim.progress.visits.surroundings import surroundings
from asbuilt_bim.progress.visits.tags import surveyed_tags, with_unread_tags
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.read import read_project
from asbuilt_bim.project.tables.places import KnownPlaces, survey_of
from asbuilt_bim.scale.cache import Cache, default_folder
from asbuilt_bim.scale.executor import one_thread, one_thread_each
from asbuilt_bim.vision.markers.find import FAMILIES
from benchmarks.sites import SAMPLE
from benchmarks.table import Line, line, options, report, told, unjudged

TIMES, QUICK_TIMES = 20, 3
MOST_SHARE = 1.0 / 3.0
Pixels = Callable[[np.ndarray, np.ndarray, np.random.Generator], tuple[np.ndarray, np.ndarray]]


def blurred(left: np.ndarray, right: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Put both out of focus, or move them while they are exposed."""
    if rng.random() < 0.5:
        sigma = float(rng.uniform(1.8, 4.0))
        return cv2.GaussianBlur(left, (0, 0), sigma), cv2.GaussianBlur(right, (0, 0), sigma)
    length, angle = int(rng.integers(8, 20)), float(rng.uniform(0.0, np.pi))
    kernel = np.zeros((length * 2 + 1, length * 2 + 1), np.float32)
    way = 0.5 * length * np.array([np.cos(angle), np.sin(angle)])
    middle = np.array([length, length])
    cv2.line(kernel, *[tuple(int(v) for v in np.round(middle + s * way)) for s in (-1, 1)], 1.0)
    kernel /= kernel.sum()
    return cv2.filter2D(left, -1, kernel), cv2.filter2D(right, -1, kernel)


def darkened(left: np.ndarray, right: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Expose both too little by four to six stops."""
    share = 2.0 ** -float(rng.uniform(4.5, 6.0))
    table = np.round(255.0 * ((np.arange(256) / 255.0) ** 2.2 * share) ** (1.0 / 2.2)).astype(np.uint8)
    return cv2.LUT(left, table), cv2.LUT(right, table)


def disc_hidden(left: np.ndarray, right: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Hang a grey cloth before all that is red, in one photo or in both."""
    which = int(rng.integers(3))
    return (_without_red(left) if which != 1 else left), (_without_red(right) if which != 0 else right)


def _without_red(image: np.ndarray) -> np.ndarray:
    blue, green, red = (channel.astype(int) for channel in cv2.split(image))
    mask = ((red > 60) & (red > 1.8 * blue) & (red > 1.8 * green)).astype(np.uint8)
    changed = image.copy()
    changed[cv2.dilate(mask, np.ones((15, 15), np.uint8)) > 0] = 110
    return changed


def tags_missing(left: np.ndarray, right: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Take all tags down but one, or none."""
    kept = int(rng.integers(2))
    order = [int(one) for one in rng.permutation(_tags(left))]
    return _without(left, order[kept:]), _without(right, order[kept:])


def _tags(image: np.ndarray) -> list[int]:
    found = _finder().detectMarkers(image)[1]
    return [] if found is None else [int(one) for one in found.ravel()]


def _finder() -> cv2.aruco.ArucoDetector:
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(FAMILIES["apriltag_36h11"]))


def _without(image: np.ndarray, tags: list[int]) -> np.ndarray:
    """Cover tags, rim and all."""
    corners, numbers, _ = _finder().detectMarkers(image)
    changed = image.copy()
    for quad, number in zip(corners, [] if numbers is None else numbers.ravel(), strict=True):
        if int(number) in tags:
            ring = quad.reshape(4, 2)
            wide = ring.mean(axis=0) + 1.3 * (ring - ring.mean(axis=0))
            cv2.fillConvexPoly(changed, np.round(wide).astype(np.int32), (122, 126, 128))
    return changed


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A fault, how it is put in, and the reasons that name it."""

    name: str
    change: Pixels | None
    named_by: frozenset[Reason]


FAULTS = (
    Fault(
        name="blur",
        change=blurred,
        named_by=frozenset({Reason.PHOTO_UNSHARP, Reason.PHOTO_MOVED, Reason.PHOTO_SMEARED}),
    ),
    Fault(name="dark", change=darkened, named_by=frozenset({Reason.PHOTO_DARK, Reason.PHOTO_UNUSABLE})),
    Fault(
        name="swapped",
        change=None,
        named_by=frozenset({Reason.PHOTOS_OF_OTHER_SIDES, Reason.PHOTOS_SWAPPED, Reason.PHOTOS_LOOK_SWAPPED}),
    ),
    Fault(
        name="disc hidden",
        change=disc_hidden,
        named_by=frozenset({Reason.TARGET_ABSENT, Reason.TARGET_IN_ONE_PHOTO, Reason.TARGET_UNPAIRED}),
    ),
    Fault(name="tags missing", change=tags_missing, named_by=frozenset({Reason.MARKERS_TOO_FEW})),
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bench:
    """The sample with its stations' photos read, and what stands by its plan."""

    project: Project
    rig: StereoRig
    options: MeasureOptions
    known: KnownPlaces
    photos: tuple[StationPhotos, ...]
    days: tuple[date, ...]  # of each

    def check(self, photos: StationPhotos) -> CheckedStation:
        """Check one station by itself."""
        outcome = sighted(photos, self.rig, self.options)
        day = self.project.visits[-1].date
        return checked_visit([outcome], self.project, self.rig, PlacedBy(known=self.known), day).stations[0]


def bench() -> Bench:
    """Read the sample."""
    project = read_project(SAMPLE / "project.yaml")
    rig = rig_of(project, Cache(folder=default_folder()), lambda *_, **__: None).rig
    known = KnownPlaces(survey=survey_of(project))
    found = [(visit.date, read_pair(station, project)) for visit in project.visits for station in visit.stations]
    pairs = [(day, one) for day, one in found if isinstance(one, StationPhotos)]
    days, photos = zip(*pairs, strict=True)
    return Bench(
        project=project, rig=rig, options=options_of(project), known=known, photos=tuple(photos), days=tuple(days)
    )


def faulty(photos: StationPhotos, fault: Fault, rng: np.random.Generator) -> StationPhotos:
    """Return a station's photos with a fault."""
    if fault.change is None:
        left, right = photos.right, photos.left
        if rng.random() < 0.5:
            left, right = (_without_exif(one) for one in (left, right))
        return replace(photos, left=left, right=right)
    left_px, right_px = fault.change(_pixels(photos.left), _pixels(photos.right), rng)
    return replace(photos, left=_stored(photos.left, left_px), right=_stored(photos.right, right_px))


def _pixels(photo: Photo) -> np.ndarray:
    flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    return np.asarray(cv2.imdecode(np.frombuffer(photo.data, np.uint8), flags))


def _stored(photo: Photo, image: np.ndarray) -> Photo:
    data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    return replace(photo_from_bytes(photo.name, data), exif=photo.exif)


def _without_exif(photo: Photo) -> Photo:
    data = cv2.imencode(".jpg", _pixels(photo), [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    return photo_from_bytes(photo.name, data)


def against(station: CheckedStation) -> set[Reason]:
    """Return all that a check says against a station."""
    return {one.code for aspect in station.aspects if aspect.grade != "ok" for one in aspect.reasons}


def named(made: Bench, times: int) -> tuple[list[Line], dict[str, object]]:
    """Put each fault in, and count how often it is named; then look at the photos as they are."""
    lines: list[Line] = []
    rows: dict[str, object] = {}
    total = 0
    for number, fault in enumerate(FAULTS):
        rng = np.random.default_rng([25, number])
        right = 0
        for turn in range(times):
            photos = made.photos[int(rng.integers(len(made.photos)))]
            said = against(made.check(faulty(photos, fault, rng)))
            right += bool(said & fault.named_by)
            rows[f"{fault.name} {turn} {photos.name}"] = sorted(said)
        total += right
        judged = line(f"{fault.name}: named", f"{right} of {times}", "all", times, right == times, least_n=TIMES)
        lines += [judged] if times >= TIMES else unjudged([judged])
    count = len(FAULTS) * times
    lines.append(line("all faults: named", f"{total} of {count}", "all", count, total == count, least_n=count))
    return lines, rows


def faultless(made: Bench) -> tuple[list[Line], dict[str, object]]:
    """Check the sample's photos as they are; then cover one tag of each, and ask whether it is told by its number."""
    lines: list[Line] = []
    good = [made.check(photos) for photos in made.photos]
    bad = [one for one in good if one.grade != "ok" or against(one)]
    lines.append(line("good stations of which something is said", str(len(bad)), "0", len(good), not bad, least_n=10))
    design = planned_design(made.project, Cache(folder=default_folder()))
    floors, tags = read_floors(made.project.ifc), surveyed_tags(made.known.survey)
    told_of, unread = 0, 0
    rng = np.random.default_rng([25, 99])
    for photos, day, station in zip(made.photos, made.days, good, strict=True):
        around = surroundings(design, begun_by(design, day), floors)

        def not_read(one: CheckedStation, around: object = around) -> tuple[int, ...]:
            by = PlacedBy(known=made.known)
            visit = checked_visit([], made.project, made.rig, by, made.project.visits[-1].date)
            seen = with_unread_tags(replace(visit, stations=(one,)), made.rig, around, tags)  # type: ignore[arg-type]
            values = next(a.values for a in seen.stations[0].aspects if a.aspect == "tags")
            found = values.get("unread", ())
            return tuple(int(v) for v in found) if isinstance(found, tuple) else ()

        before = not_read(station)
        unread += len(before)
        tag = int(rng.choice(_tags(_pixels(photos.left))))
        pixels = (_without(_pixels(one), [tag]) for one in (photos.left, photos.right))
        covered = [_stored(one, image) for one, image in zip((photos.left, photos.right), pixels, strict=True)]
        told_of += tag in not_read(made.check(replace(photos, left=covered[0], right=covered[1])))
    lines.append(told("one covered tag of several: told by its number", f"{told_of} of {len(good)}", len(good)))
    lines.append(told("tags listed as not read on good photos", str(unread), len(good)))
    return lines, {}


def timed(made: Bench, stations: int) -> list[Line]:
    """Time the check of stations beside their measurement, one after the other in one run."""
    shares = []
    for photos in made.photos[-stations:]:
        start = time.process_time()
        made.check(photos)
        middle = time.process_time()
        measure_station(photos, made.rig, made.options)
        shares.append((middle - start) / (time.process_time() - middle))
    share = float(np.mean(shares))
    return [
        line("a check's share of measuring, mean", f"{share:.2f}", "0.33", len(shares), share <= MOST_SHARE, least_n=1),
        told("the same, the largest", f"{max(shares):.2f}", len(shares)),
    ]


@one_thread()
def main() -> int:
    """Put the faults in, look at good photos, time both, and print the table."""
    args = options(__doc__ or "").parse_args()
    made = bench()
    made.check(made.photos[0])  # what is laid out once is laid out
    lines, rows = named(made, QUICK_TIMES if args.quick else TIMES)
    if not args.quick:
        lines += faultless(made)[0]
    lines += timed(made, 1 if args.quick else 10)
    return report("a check on site", lines, args, rows=rows)


if __name__ == "__main__":
    one_thread_each()
    sys.exit(main())
