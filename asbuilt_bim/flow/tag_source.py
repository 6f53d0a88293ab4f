"""A rig from photos of tags, once: the same photos and tags come from the cache."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain

from asbuilt_bim.camera.calibration.board_views import pair_subject, read_pairs
from asbuilt_bim.camera.calibration.calibrate import Calibration, named
from asbuilt_bim.camera.calibration.tag_rig import rig_from_tags
from asbuilt_bim.camera.calibration.tags import Tag, TagSighting
from asbuilt_bim.camera.lens import LensModel
from asbuilt_bim.camera.photo.read import Photo, decode
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import CalibrationError, PhotoError, Rejection, rejected
from asbuilt_bim.flow.measure_visit import Progress
from asbuilt_bim.report.wording.reasons import reason_list
from asbuilt_bim.scale.cache import Cache, digest_of
from asbuilt_bim.scale.executor import one_thread
from asbuilt_bim.scale.fingerprint import library_versions, measuring_code_digest
from asbuilt_bim.vision.markers.in_photos import tags_in_pair


@dataclass(frozen=True, slots=True, kw_only=True)
class Tags:
    """The tags that photos show, and the lens to fit."""

    tag: Tag
    family: str
    lens: LensModel = "five"


@one_thread()
def calibrate_tags(
    pairs: Sequence[tuple[Photo, Photo]],
    tags: Tags,
    cache: Cache,
    progress: Progress,
    already_out: Sequence[Rejection] = (),
) -> Calibration:
    """Calibrate from pairs of photos that show tags, once.

    Raises: CalibrationError where they give no rig, with what is missing.
    """
    libraries = [f"{name} {version}" for name, version in sorted(library_versions().items())]
    photos = [text for pair in pairs for photo in pair for text in (photo.digest, photo.name)]
    key = digest_of(["rig of tags", repr(tags), measuring_code_digest(), *libraries, *photos, repr(already_out)])
    if (found := cache.get(key, Calibration)) is not None:
        return found
    try:
        made = _made(pairs, tags, progress, already_out)
    except CalibrationError as problem:
        raise CalibrationError(f"{problem}{reason_list(problem)}", problem.rejections) from problem
    cache.put(key, made, Calibration)
    return made


def _made(
    pairs: Sequence[tuple[Photo, Photo]], tags: Tags, progress: Progress, already_out: Sequence[Rejection]
) -> Calibration:
    def look(left: Photo, right: Photo) -> list[TagSighting] | Rejection:
        subject = pair_subject(left, right)
        try:
            seen = tags_in_pair(subject.name, decode(left), decode(right), tags.family)
        except PhotoError as error:
            return rejected(Reason.PHOTO_UNUSABLE, subject, detail=str(error))
        return seen or rejected(Reason.TAGS_NOT_FOUND, subject, family=tags.family)

    seen, size, left_out = read_pairs(pairs, look, lambda done, total: progress("calibrate", done, total))
    sightings = list(chain(*seen))
    made = rig_from_tags(sightings, size, tags.tag, tags.lens, [*already_out, *left_out])
    left, right = next(pair for pair in pairs if pair_subject(*pair).name == sightings[0].pair)
    return replace(made, rig=named(made.rig, left.exif, right.exif))
