"""What a project knows of places: the survey of its markers, poses that other instruments gave, and points clicked."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import TypeVar

import numpy as np

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import Rejection, SurveyError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import inverse, rigid, rotation_from_vector
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.tables.survey import read_survey
from asbuilt_bim.register.placement import ControlPoint, given_pose, levelled
from asbuilt_bim.register.pose import StationPose, SurveyedMarker
from asbuilt_bim.register.survey import (
    FAR_M,
    MAX_COORDINATE_M,
    check_survey,
    metres,
)
from asbuilt_bim.storage.table_file import Columns, TableFile, TableRow, day_in, number_in, read_table, refused_rows

POSES: Columns = {
    "date": ("day", "datum", "visit"),
    "station": ("name",),
    "x_m": ("x", "easting", "east"),
    "y_m": ("y", "northing", "north"),
    "z_m": ("z", "height", "elevation"),
    "bearing_deg": ("bearing", "azimuth", "heading"),
    "pitch_deg": ("pitch",),
    "roll_deg": ("roll",),
    "sigma_m": ("sigmam",),
    "sigma_deg": ("sigmadeg",),
}
"""What a column of poses may be called."""
POINTS: Columns = {
    "date": ("day", "datum", "visit"),
    "station": ("name",),
    "point": ("id", "target"),
    "x_m": ("x", "easting"),
    "y_m": ("y", "northing"),
    "z_m": ("z", "height"),
    "x_px": ("column", "u"),
    "y_px": ("row", "v"),
}
"""What a column of clicked points may be called."""
MOST_SIGMA_M, MOST_SIGMA_DEG, LEAST_SIGMA = 5.0, 45.0, 1e-5
MOST_PIXEL = 100_000.0
Row = TypeVar("Row")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GivenPose:
    """A row of poses: of which visit (None: of every one) and station, and `world_from_left` (4, 4) with its sigmas."""

    day: date | None
    station: str
    world_from_left: FloatArray
    sigma_m: float
    sigma_rad: float
    by_plumb: bool = False  # its pitch or its roll is left out: what is plumb in the photos says both


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClickedPoint:
    """A row of points: `world_m` (3,), and where the station's left photo, as it was taken, shows it (2,)."""

    day: date | None
    station: str
    point: str
    world_m: FloatArray
    photo_px: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownPlaces:
    """All of it: the survey, poses, and points of every visit."""

    survey: tuple[SurveyedMarker, ...]
    poses: tuple[GivenPose, ...] = ()
    points: tuple[ClickedPoint, ...] = ()

    def given(self, day: date, measured: Sequence[StationMeasurement] | None = None) -> dict[str, StationPose]:
        """Return a visit's given poses by station.

        Pitch and roll that are left out are those that the `measured` station's plumb lines show; of one that shows
        none they are open. Where nothing is measured yet, the camera is taken for level.
        """
        ups = None if measured is None else {one.station: one.vertical for one in measured}
        found: dict[str, StationPose] = {}
        for one in self.poses:
            if one.day not in (None, day):
                continue
            pose = given_pose(one.station, one.world_from_left, one.sigma_rad, one.sigma_m)
            if one.by_plumb and ups is not None:
                up = ups.get(one.station)
                pose = _open(pose) if up is None else levelled(pose, up)
            found[one.station] = pose
        return found

    def clicked(
        self, day: date, rig: StereoRig, measured: Sequence[StationMeasurement]
    ) -> dict[str, list[ControlPoint]]:
        """Return a visit's points by station, in its rectified pixels: clicks go through the rig's lens model."""
        found: dict[str, list[ControlPoint]] = {}
        cameras = {one.station: one.camera for one in measured}
        for one in self.points:
            if one.day not in (None, day) or one.station not in cameras:
                continue
            pixel = cameras[one.station].project(rig.left.rays(one.photo_px[None]))[0]
            if not np.all(np.isfinite(pixel)):
                continue  # outside the lens's own field
            point = ControlPoint(name=one.point, world_m=one.world_m, left_px=frozen(pixel))
            found.setdefault(one.station, []).append(point)
        return found


def survey_of(project: Project) -> tuple[SurveyedMarker, ...]:
    """Return the surveyed markers of a project, none where it has no survey.

    Raises:
        SurveyError: the survey can't be used.
    """
    size_m = project.markers.size_m
    if project.survey is None or size_m is None:
        return ()
    return read_survey(project.survey, size_m, project.markers.sigma_m)


def known_places(project: Project, on_map: Callable[[], tuple[FloatArray, float]]) -> KnownPlaces:
    """Read all that a project knows of places.

    `on_map` gives the move (4, 4) from the IFC's world to its map and the map's scale, where coordinates are the map's.

    Raises:
        SurveyError: a table can't be used; every row that is wrong is named, up to eight.
    """
    poses: tuple[GivenPose, ...] = ()
    points: tuple[ClickedPoint, ...] = ()
    if project.poses is not None:
        poses = _rows(project, project.poses, POSES, ("station", "x_m", "y_m", "z_m", "bearing_deg", "sigma_m"), _pose)
        if project.poses_on_map:
            map_from_world, scale = on_map()
            poses = tuple(_from_map(one, map_from_world, scale) for one in poses)
    if project.control_points is not None:
        needed = ("station", "point", "x_m", "y_m", "z_m", "x_px", "y_px")
        points = _rows(project, project.control_points, POINTS, needed, _point)
    return KnownPlaces(survey=survey_of(project), poses=poses, points=points)


def check_places(places: KnownPlaces, design: BimModel) -> tuple[Rejection, ...]:
    """Name the surveyed markers that lie far from the design's building.

    Raises:
        SurveyError: most markers, given poses or clicked points do: they are of other coordinates or in another unit.
    """
    stray = check_survey(places.survey, design)
    poses = [(one.station, one.world_from_left[:3, 3]) for one in places.poses]
    points = [(one.point, one.world_m) for one in places.points]
    for key, given in (("poses", poses), ("control_points", points)):
        away_m = design.off_box_m(np.array([at for _, at in given]).reshape(-1, 3))
        far = [(name, away) for (name, _), away in zip(given, away_m, strict=True) if away > FAR_M]
        if 2 * len(far) > len(given):
            raise SurveyError(
                f"{key}: {len(far)} of {len(given)} lie further than {FAR_M:.0f} m from the building of "
                f"{design.file_name} ({far[0][0]}: {metres(far[0][1])}). Give them in metres, in the IFC's world "
                "coordinates; poses with `coordinates: map` in those of its IfcMapConversion"
            )
    return stray


def _rows(
    project: Project,
    path: Path,
    columns: Columns,
    needed: Sequence[str],
    read: Callable[[TableRow, TableFile], Row],
) -> tuple[Row, ...]:
    table = read_table(path, columns, needed, SurveyError)
    found: list[Row] = []
    faults: list[str] = []
    for row in table.rows:
        try:
            known_station(project, row)
            found.append(read(row, table))
        except ValueError as problem:
            faults.append(f"row {row.number}: {problem}")
    refused_rows(path, faults, SurveyError)
    return tuple(found)


def known_station(project: Project, row: TableRow) -> None:
    """See that a row's station is in the project, on its day where it names one.

    Raises:
        ValueError: it isn't.
    """
    day, name = day_in(row, "date"), row.text("station").strip()
    names = {station.name for visit in project.visits if day in (None, visit.date) for station in visit.stations}
    if name not in names:
        of = f" of {day}" if day is not None else ""
        raise ValueError(f"there is no station '{name[:60]}'{of} in the project file")


def number_of(
    row: TableRow, column: str, table: TableFile, low: float, high: float, default: float | None = None
) -> float:
    """Return a cell's number, the `default` where it is empty.

    Raises:
        ValueError: there is none, or it isn't from `low` to `high`.
    """
    value = number_in(row, column, table)
    value = default if value is None else value
    if value is None:
        raise ValueError(f"{column} is empty")
    if not low <= value <= high:
        raise ValueError(f"{column} is {value:g}; it is a number from {low:g} to {high:g}")
    return value


def _xyz(row: TableRow, table: TableFile) -> FloatArray:
    return np.array(
        [number_of(row, axis, table, -MAX_COORDINATE_M, MAX_COORDINATE_M) for axis in ("x_m", "y_m", "z_m")]
    )


def _pose(row: TableRow, table: TableFile) -> GivenPose:
    bearing = np.radians(number_of(row, "bearing_deg", table, -360.0, 360.0))
    pitch = np.radians(number_of(row, "pitch_deg", table, -90.0, 90.0, 0.0))
    roll = np.radians(number_of(row, "roll_deg", table, -180.0, 180.0, 0.0))
    sigma_deg = number_of(row, "sigma_deg", table, LEAST_SIGMA, MOST_SIGMA_DEG, MOST_SIGMA_DEG)
    return GivenPose(
        day=day_in(row, "date"),
        station=row.text("station").strip(),
        world_from_left=frozen(rigid(looking(float(bearing), float(pitch), float(roll)), _xyz(row, table))),
        sigma_m=number_of(row, "sigma_m", table, LEAST_SIGMA, MOST_SIGMA_M),
        sigma_rad=float(np.radians(sigma_deg)),
        by_plumb=not (row.text("pitch_deg").strip() and row.text("roll_deg").strip()),
    )


def _point(row: TableRow, table: TableFile) -> ClickedPoint:
    pixel = [number_of(row, axis, table, -MOST_PIXEL, MOST_PIXEL) for axis in ("x_px", "y_px")]
    return ClickedPoint(
        day=day_in(row, "date"),
        station=row.text("station").strip(),
        point=row.text("point").strip()[:60],
        world_m=frozen(_xyz(row, table)),
        photo_px=frozen(pixel),
    )


def _open(pose: StationPose) -> StationPose:
    """Return a pose of whose pitch and roll nothing is known."""
    covariance = pose.covariance.copy()
    covariance[:2, :2] = np.eye(2) * np.radians(MOST_SIGMA_DEG) ** 2
    return replace(pose, covariance=frozen(covariance))


def looking(bearing_rad: float, pitch_rad: float, roll_rad: float) -> FloatArray:
    """Return the turn (3, 3) of a camera: bearing clockwise from y as seen from above, pitch up, roll clockwise."""
    level = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # x right, y down, z along the world's y
    turned: FloatArray = (
        rotation_from_vector([0.0, 0.0, -bearing_rad])
        @ level
        @ rotation_from_vector([pitch_rad, 0.0, 0.0])
        @ rotation_from_vector([0.0, 0.0, roll_rad])
    )
    return turned


def _from_map(one: GivenPose, map_from_world: FloatArray, scale: float) -> GivenPose:
    """Return a pose in the IFC's world: a map shrinks level distances from its origin by its scale."""
    pose = one.world_from_left.copy()
    origin = map_from_world[:3, 3]
    pose[:3, 3] = origin + (pose[:3, 3] - origin) / np.array([scale, scale, 1.0])
    return replace(one, world_from_left=frozen(inverse(map_from_world) @ pose))
