"""The three states of each design face after a visit."""

from dataclasses import dataclass

from asbuilt_bim.bim.model import DesignFace
from asbuilt_bim.codes import Note
from asbuilt_bim.geometry.arrays import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurfaceState:
    """Built, open and unknown pieces of one design face's EXPOSED surface: polygons in its (u, v) metres.

    Areas in m2; `stations` maps a station's name to the area (m2) of this face it decided. `as_built_area_m2` is the
    area of the UNION of all stations' outlines in this face's plane, None where no face was matched.
    """

    face_id: str
    element: str
    built_uv_m: tuple[tuple[FloatArray, ...], ...]
    open_uv_m: tuple[tuple[FloatArray, ...], ...]
    unknown_uv_m: tuple[tuple[FloatArray, ...], ...]
    outline_uv_m: tuple[tuple[FloatArray, ...], ...]  # union of all measured outlines, this visit's and earlier ones'
    built_area_m2: float
    open_area_m2: float
    unknown_area_m2: float
    as_built_area_m2: float | None
    as_built_sigma_calibration_m2: float
    as_built_sigma_image_m2: float
    offset_m: float | None
    offset_sigma_m: float | None
    tilt_rad: float | None
    stations: dict[str, float]
    conflict_area_m2: float  # seen built by one station and open by another
    notes: tuple[Note, ...]
    parts: tuple[str, ...] = ()  # measured faces (ids) that looked whole, while concrete goes on past their outlines
    doubts: tuple[Note, ...] = ()  # of the notes, what to look at before it is paid for
    gone_area_m2: float = 0.0  # an earlier visit saw it built, and it looks open now
    whole: bool = False  # its as-built area is that of stations which saw it whole, now or earlier
    was_open_uv_m: tuple[tuple[FloatArray, ...], ...] = ()  # of the unknown, what was open when it was last seen


def unseen(face: DesignFace) -> SurfaceState:
    """Return the state of a face of which nothing is known."""
    return SurfaceState(
        face_id=face.face_id, element=face.element, built_uv_m=(), open_uv_m=(), unknown_uv_m=face.exposed_uv_m,
        outline_uv_m=(), built_area_m2=0.0, open_area_m2=0.0, unknown_area_m2=face.exposed_area_m2,
        as_built_area_m2=None, as_built_sigma_calibration_m2=0.0, as_built_sigma_image_m2=0.0, offset_m=None,
        offset_sigma_m=None, tilt_rad=None, stations={}, conflict_area_m2=0.0, notes=(),
    )  # fmt: skip
