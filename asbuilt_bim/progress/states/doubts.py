"""What to look at before a face is paid for: what is gone, goes on past the design, or has another size."""

from collections.abc import Iterator, Sequence

import numpy as np

from asbuilt_bim.bim.model import BimElement, DesignFace
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import State
from asbuilt_bim.progress.surface import SurfaceState

GONE_M2 = 0.25
"""Half of a column's side between floors at 0.2 m; a strip that a pose errs by along a storey's height is 0.15 m2."""
PAST_SHARE, PAST_M2 = 0.1, 0.5
"""How much of a measured face may lie past the design's border: what its mask and the next element's joint err by."""
OTHER_SIZE = 0.05
"""A face this much smaller or larger than its design is another one: 2 cm of a column's side of 0.4 m."""


def past_design(matches: Sequence[FaceMatch], options: ProgressOptions) -> Iterator[Note]:
    """Yield where a measured face goes on past its design by more than a mask and a joint err by."""
    for match in matches:
        past_m2 = match.past_design_m2
        allowed_m2 = max(PAST_M2, PAST_SHARE * match.area_m2, options.sigmas * match.area_sigma_image_m2)
        if past_m2 > allowed_m2:
            subject = about(SubjectKind.FACE, match.face_id, match.station)
            yield noted(Reason.PAST_DESIGN, subject, area_m2=past_m2)


def doubts_of(
    element: BimElement, surfaces: Sequence[SurfaceState], state: State, options: ProgressOptions
) -> Iterator[Note]:
    """Yield what is doubtful of an element, by its faces."""
    gone_m2 = sum(surface.gone_area_m2 for surface in surfaces if surface.gone_area_m2 >= GONE_M2)
    if gone_m2:
        subject = about(SubjectKind.ELEMENT, element.global_id)
        yield noted(Reason.GONE, subject, area_m2=gone_m2)
    for face, surface in zip(element.faces, surfaces, strict=True):
        yield from surface.doubts
        size = other_size(face, surface, options) if state == "complete" else None
        if size is not None:
            yield size


def other_size(face: DesignFace, surface: SurfaceState, options: ProgressOptions) -> Note | None:
    """Say of a face of a complete element that it was seen whole and measures something else than designed."""
    if not surface.whole or surface.as_built_area_m2 is None or isinstance(face.frame, CylinderFrame):
        return None
    sigma_m2 = float(np.hypot(surface.as_built_sigma_image_m2, surface.as_built_sigma_calibration_m2))
    allowed_m2 = max(OTHER_SIZE * face.exposed_area_m2, options.sigmas * sigma_m2)
    other_m2 = surface.as_built_area_m2 - face.exposed_area_m2
    in_pieces = surface.built_area_m2 > surface.as_built_area_m2 + allowed_m2  # a door parts it: one piece was measured
    if abs(other_m2) <= allowed_m2 or in_pieces:
        return None
    values: Values = {"area_m2": surface.as_built_area_m2, "sigma_m2": sigma_m2, "design_m2": face.exposed_area_m2}
    return noted(Reason.OTHER_SIZE, about(SubjectKind.FACE, face.face_id), **values)
