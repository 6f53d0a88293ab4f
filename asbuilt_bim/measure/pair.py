"""One photo pair measured without any design: the paper's own use, and what its outputs are made from."""

from dataclasses import dataclass, replace

from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import MeasureError, Rejection, rejected
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.depth_source import Method, missing_network
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.station import (
    MeasureOptions,
    Models,
    RejectedStation,
    StationDetail,
    StationPhotos,
    measure_in_detail,
)
from asbuilt_bim.measure.station_faces import judge_face
from asbuilt_bim.vision.masks.given import photo_from_rectified
from asbuilt_bim.vision.masks.segment import Instance
from asbuilt_bim.vision.stereo.rig_health import RigVerdict, StationHealth, judge, refined_rig
from asbuilt_bim.vision.stereo.rig_rejection import RIG, rig_doubt, rig_rejection
from asbuilt_bim.vision.target.find import TargetSighting


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairMeasurement:
    """The faces of one photo pair, and all that their pictures are drawn from.

    `rejections` name what was left out: faces, masks in which nothing was measured, other red discs.
    """

    detail: StationDetail
    rig: StereoRig
    options: MeasureOptions
    left_name: str
    right_name: str
    rejections: tuple[Rejection, ...]

    @property
    def faces(self) -> tuple[MeasuredFace, ...]:
        """Return the measured faces."""
        return self.detail.measurement.faces

    @property
    def target(self) -> TargetSighting | None:
        """Return the red disc, None where the scale is the rig's baseline alone."""
        return self.detail.measurement.target

    @property
    def calibration_known(self) -> bool:
        """Say whether the rig knows how sure it is; where not, sigmas hold what such a rig is trusted to."""
        return bool(self.rig.covariance.any())

    def instance_of(self, face: MeasuredFace) -> Instance:
        """Return the wall or column that a face belongs to."""
        return self.detail.instances[face.instance]

    def photo_outline_px(self, face: MeasuredFace) -> tuple[FloatArray, ...]:
        """Return a face's rings (N, 2) in pixels of the ORIGINAL left photo."""
        return tuple(photo_from_rectified(ring, self.rig.left, self.detail.pair.camera) for ring in face.outline_px)


def measure_photos(
    photos: StationPhotos, rig: StereoRig, options: MeasureOptions, models: Models, *, refine: bool = False
) -> PairMeasurement:
    """Measure a pair with the rig that took it; with `refine`, as its own photos show it where it has moved.

    Where `options.target.required` is off the rig's baseline alone gives the scale, and no marker is asked for.

    Raises:
        MeasureError: the pair can't be measured; its `rejections` hold every reason.
    """
    missing = missing_network(options.method, options.depth, models.relative_depth)
    if missing:
        raise MeasureError(missing)
    chosen = options if options.target.required else replace(options, least_markers_without_target=0)
    found = measure_in_detail(photos, rig, chosen, models=models)
    verdict, refined = _verdict(found, rig), False
    notes: tuple[Rejection, ...] = ()
    if verdict is not None and refine and verdict.state in ("doubtful", "knocked"):
        notes = (rig_rejection(Reason.RIG_REFINED, RIG, verdict),)
        rig, refined = _refined(found, rig, verdict), True
        found = measure_in_detail(photos, rig, chosen, models=models)
        verdict = _verdict(found, rig)
    if isinstance(found, RejectedStation):
        raise MeasureError(f"{photos.name}: the pair can't be measured", found.rejections)
    if options.method == "default":
        found = _without_design(found, chosen)
    if verdict is not None:
        notes += _doubts(verdict, photos.name, rig, refined=refined)
    rejections = (*notes, *found.measurement.rejections)
    if models.segmenter is not None:
        rejections = (*rejections, *_unmeasured(found, photos.name))
    return PairMeasurement(
        detail=found, rig=rig, options=chosen, left_name=photos.left.name, right_name=photos.right.name,
        rejections=rejections,
    )  # fmt: skip


def _without_design(found: StationDetail, options: MeasureOptions) -> StationDetail:
    kept, left_out = list[MeasuredFace](), list(found.measurement.rejections)
    for face in found.measurement.faces:
        judge_face(face.without_design(), kept, left_out, options.faces, Reason.FACE_WITHOUT_END)
    return replace(found, measurement=replace(found.measurement, faces=tuple(kept), rejections=tuple(left_out)))


def _health(found: StationDetail | RejectedStation) -> StationHealth | None:
    return found.measurement.health if isinstance(found, StationDetail) else found.health


def _verdict(found: StationDetail | RejectedStation, rig: StereoRig) -> RigVerdict | None:
    """Judge the rig by this pair, as a run judges that of a visit; None where too few matches say anything of it."""
    health = _health(found)
    return None if health is None else judge([health], rig)


def _refined(found: StationDetail | RejectedStation, rig: StereoRig, verdict: RigVerdict) -> StereoRig:
    health = _health(found)
    return rig if health is None else refined_rig(rig, verdict, health.camera)


def _doubts(verdict: RigVerdict, name: str, rig: StereoRig, *, refined: bool) -> tuple[Rejection, ...]:
    """Return what a run would warn of at this pair.

    Raises:
        MeasureError: a run would refuse it: the rig was knocked.
    """
    if verdict.state == "knocked":
        knocked = rig_rejection(Reason.RIG_KNOCKED, about(SubjectKind.STATION, name), verdict)
        raise MeasureError(f"{name}: the pair can't be measured", (knocked,))
    doubt = rig_doubt(verdict, (name,), rig, refined=refined)
    return () if doubt is None else (doubt,)


def dominating(face: MeasuredFace, *, calibration_known: bool) -> str:
    """Return what an area's sigma comes from most: `calibration`, one that is only assumed, or `image`."""
    if face.area_sigma_calibration_m2 <= face.area_sigma_image_m2:
        return "image"
    return "calibration" if calibration_known else "calibration (assumed)"


def seen(face: MeasuredFace, method: Method) -> str:
    """Return how much of a face was seen: `whole`, or why not.

    `cut` by the photo's border, `hidden` in part, `open`: a side isn't proven to be its end; several joined by "and".

    The published method doesn't ask whether something stands before a face: `not checked` where the photo's border
    doesn't cut it.
    """
    flags = (("cut", face.cut_by_frame), ("hidden", face.occluded), ("open", face.open_edge))
    words = [word for word, is_so in flags if is_so]
    return " and ".join(words) or ("whole" if method == "default" else "not checked")


def _unmeasured(found: StationDetail, name: str) -> list[Rejection]:
    """Name the instances in which no face was measured."""
    measured = {face.instance for face in found.measurement.faces}
    return [
        rejected(
            Reason.INSTANCE_WITHOUT_FACE,
            about(SubjectKind.INSTANCE, f"{instance.label} {number + 1}", name),
            label=instance.label,
            source=str(instance.source),
            segmenter=instance.segmenter,
        )
        for number, instance in enumerate(found.instances)
        if number not in measured
    ]
