"""The three states of each design face after a visit."""

from dataclasses import dataclass

from asbuilt_bim.bim.model import DesignFace
from asbuilt_bim.codes import Note
from asbuilt_bim.geometry import polygon
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
    whole: bool = False  # its as-built area is of stations which saw it whole, now, or earlier with nothing of it open
    tilt_sigma_rad: float | None = None
    row_log_odds: FloatArray | None = None  # how clearly this visit shows each row of its cells built, or open
    border_m: float = 0.0  # how far the borders of built and open may lie elsewhere, since lengths are doubtful


def unseen(face: DesignFace, again: bool = False) -> SurfaceState:
    """Return the state of a face of which nothing is known; `again`, after an earlier visit knew nothing either.

    Its outline then begins at the corner where the one of a face begins that was judged: results stay the same.
    """
    exposed = polygon.difference(face.exposed_uv_m, polygon.EMPTY) if again else face.exposed_uv_m
    return SurfaceState(
        face_id=face.face_id, element=face.element, built_uv_m=(), open_uv_m=(), unknown_uv_m=exposed,
        outline_uv_m=(), built_area_m2=0.0, open_area_m2=0.0, unknown_area_m2=face.exposed_area_m2,
        as_built_area_m2=None, as_built_sigma_calibration_m2=0.0, as_built_sigma_image_m2=0.0, offset_m=None,
        offset_sigma_m=None, tilt_rad=None, stations={}, conflict_area_m2=0.0, notes=(),
    )  # fmt: skip


def knows_anything(state: SurfaceState | None) -> bool:
    """Say whether an earlier state tells more than that nothing is known: of such a face a visit has to decide anew."""
    if state is None:
        return False
    return any((state.built_uv_m, state.open_uv_m, state.outline_uv_m)) or state.as_built_area_m2 is not None
