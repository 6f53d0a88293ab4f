"""`method: paper`: the published pipeline from mask and depth map to areas (eq. 5, 6, Algorithm 1), to compare with.

Every trap of it is kept. The area is that of the face's shadow on the image plane, and the mask is used as it is. Two
faces of a column are one outline, and no uncertainty is known.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.codes import Reason, SubjectKind, Value, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import ring_area
from asbuilt_bim.measure.algorithm_1 import boundary_pixels, world_from_boundary
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.station_faces import FaceOptions, StationFaces
from asbuilt_bim.vision.masks.segment import Instance
from asbuilt_bim.vision.stereo.depth import DepthMap

TILT_RAD = 1e-3
"""The plane of a shadow is the image plane by definition; a milliradian keeps its covariance invertible."""


def paper_faces(
    pair: RectifiedPair, depth: DepthMap, instances: Sequence[Instance], options: FaceOptions
) -> StationFaces:
    """Measure each instance as the paper does: one outline per mask, in (X_w, Y_w).

    `area_sigma_image_m2` is the area itself: the method states no uncertainty, so nothing may rest on its number alone.

    Reference: Perez & Tah 2023, sections 3.3 and 3.4.
    """
    faces: list[MeasuredFace] = []
    rejections: list[Rejection] = []
    for number, instance in enumerate(instances):
        name = f"{pair.name}/{len(faces) + 1}"
        face = _face(pair, depth, instance, number, name)
        if face is None:
            subject = about(SubjectKind.INSTANCE, f"{instance.label} {number + 1}", pair.name)
            values = _without_depth(depth, instance)
            rejections.append(rejected(Reason.INSTANCE_WITHOUT_DEPTH, subject, **values))
        elif face.area_m2 >= options.least_area_m2:
            faces.append(face)
    return StationFaces(faces=tuple(faces), rejections=tuple(rejections), up=None)


def _face(pair: RectifiedPair, depth: DepthMap, instance: Instance, number: int, name: str) -> MeasuredFace | None:
    pixels = boundary_pixels(instance.mask)
    at = pixels.astype(np.intp)
    z = np.asarray(depth.depth_m[at[:, 1], at[:, 0]], dtype=np.float64)
    known = np.isfinite(z)
    if np.count_nonzero(known) < 3:
        return None
    pixels, z = pixels[known], z[known]
    world = world_from_boundary(pixels, z, pair.camera.K)
    outline = world * [1.0, -1.0]  # Y_w points down, a face's v points up
    if ring_area(outline) < 0.0:
        outline, pixels = outline[::-1], pixels[::-1]
    middle_m = float(np.median(z))
    low, high = outline.min(axis=0), outline.max(axis=0)
    area = ring_area(outline)
    centre = np.array([*(outline.mean(axis=0) * [1.0, -1.0]), middle_m])
    x0, y0 = pixels.min(axis=0)
    x1, y1 = pixels.max(axis=0)
    return MeasuredFace(
        face_id=name, label=instance.label, score=instance.score, source=instance.source, segmenter=instance.segmenter,
        frame=_image_plane(pair.camera, middle_m),
        outline_uv_m=(frozen(outline),), outline_px=(frozen(pixels),), area_m2=area, area_sigma_calibration_m2=0.0,
        area_sigma_image_m2=area, covariance=frozen(np.diag([0.25 * middle_m**2, TILT_RAD**2, TILT_RAD**2])),
        width_m=float(high[0] - low[0]), height_m=float(high[1] - low[1]), width_px=float(min(x1 - x0, y1 - y0)),
        distance_m=float(np.linalg.norm(centre)), cut_by_frame=_at_border(pair, instance), occluded=False,
        flatness_rms_m=float(np.std(z)), instance=number,
    )  # fmt: skip


def _image_plane(camera: RectifiedCamera, z_m: float) -> PlaneFrame:
    """Return the plane Z = z_m with u = X_w and v = -Y_w, in the LEFT frame; it faces the camera."""
    left_from_rectified = camera.rectified_from_left.T
    return PlaneFrame(
        origin_m=frozen(left_from_rectified @ np.array([0.0, 0.0, z_m])),
        u=frozen(left_from_rectified @ np.array([1.0, 0.0, 0.0])),
        v=frozen(left_from_rectified @ np.array([0.0, -1.0, 0.0])),
    )


def _at_border(pair: RectifiedPair, instance: Instance) -> bool:
    """Say whether a mask reaches where the left photo ends."""
    inner = cv2.erode(pair.valid_left.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=0) > 0
    return bool(np.any(instance.mask & ~inner))


def _without_depth(depth: DepthMap, instance: Instance) -> dict[str, Value]:
    """Return how many of a mask's boundary pixels have no depth."""
    at = boundary_pixels(instance.mask).astype(np.intp)
    lost = int(np.count_nonzero(~depth.valid[at[:, 1], at[:, 0]]))
    return {"pixels_without": lost, "pixels": len(at), "depth": depth.method}
