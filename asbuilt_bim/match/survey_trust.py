"""May a survey decide anything? One that lies beside the design doesn't, unless a person accepts its very shift."""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.match.result import MatchResult
from asbuilt_bim.match.survey_shift import survey_shift
from asbuilt_bim.register.pose import PlacedStation, Placement
from asbuilt_bim.scale.share import Share, in_turn

SHIFTS = frozenset({Reason.SURVEY_SHIFTED, Reason.SURVEY_SHIFTED_IN_HEIGHT})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shift:
    """How all that is measured lies off its design: turned about an upright axis, then moved."""

    move_m: FloatArray  # (3,)
    turn_rad: float = 0.0  # counter-clockwise, seen from above
    about_m: FloatArray  # (2,) in the world, where the axis stands

    @property
    def moves_m(self) -> tuple[float, float, float]:
        """Return the move as plain numbers."""
        return float(self.move_m[0]), float(self.move_m[1]), float(self.move_m[2])

    def undo(self) -> FloatArray:
        """Return the transform (4, 4) of the world that takes the shift off."""
        turn = rotation_from_vector([0.0, 0.0, self.turn_rad])
        axis = np.append(self.about_m, 0.0)
        return rigid(turn.T, axis - turn.T @ (axis + self.move_m))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeldAgainstDesign:
    """What the placed stations' faces say, of no station where the survey is refused; then why, the survey first."""

    matched: MatchResult
    rejections: tuple[Rejection, ...]
    notes: tuple[Note, ...]


def hold_against_design(
    placement: Placement,
    design: BimModel,
    options: MatchOptions,
    accepted: Shift | None = None,
    share: Share = in_turn,
) -> HeldAgainstDesign:
    """Match what was measured, as `share` has it, and refuse every station where all of it lies beside the design.

    A shift that a person has accepted is taken off the stations, where nothing speaks of another one then: photos of
    one storey may fit two that are alike, and the person knows which. Else the survey is refused as before.
    """
    matched = match_faces(placement, design, options, share)
    faults = survey_shift(matched, design)
    if accepted is None:
        return _held(matched, faults, design, options)
    if not faults:
        return _held(matched, (), design, options, (_of_shift(Reason.SHIFT_NOT_NEEDED, accepted),))
    if all(fault.code in SHIFTS for fault in faults):
        moved = replace(placement, stations=tuple(_moved(one, accepted.undo()) for one in placement.stations))
        back = match_faces(moved, design, options, share)
        if not survey_shift(back, design):
            return _held(back, (), design, options, (_of_shift(Reason.SHIFT_ACCEPTED, accepted),))
    subject = about(SubjectKind.SURVEY)
    other = rejected(Reason.SHIFT_OTHER_THAN_ACCEPTED, subject, move_m=accepted.moves_m, turned_rad=accepted.turn_rad)
    return _held(matched, (*faults, other), design, options)


def without_stations(matched: MatchResult, design: BimModel, options: MatchOptions) -> MatchResult:
    """Return what is matched where not one station counts."""
    return match_faces(Placement(stations=(), rejections=()), design, options) if matched.stations else matched


def refused_stations(matched: MatchResult, code: Reason) -> tuple[Rejection, ...]:
    """Return a rejection of every matched station, for what is wrong with all of them together."""
    return tuple(rejected(code, about(SubjectKind.STATION, one.pose.station)) for one in matched.stations)


def _held(
    matched: MatchResult,
    faults: tuple[Rejection, ...],
    design: BimModel,
    options: MatchOptions,
    notes: tuple[Note, ...] = (),
) -> HeldAgainstDesign:
    if not faults:
        return HeldAgainstDesign(matched=matched, rejections=(), notes=notes)
    stations = refused_stations(matched, Reason.STATION_SURVEY_REFUSED)
    return HeldAgainstDesign(
        matched=without_stations(matched, design, options), rejections=(*faults, *stations), notes=notes
    )


def _moved(placed: PlacedStation, move: FloatArray) -> PlacedStation:
    """Return a station moved in the world; its pose's covariance is in world axes and turns with it."""
    turn = np.kron(np.eye(2), move[:3, :3])
    pose = replace(
        placed.pose,
        world_from_left=frozen(move @ placed.pose.world_from_left),
        covariance=frozen(turn @ placed.pose.covariance @ turn.T),
    )
    return replace(placed, pose=pose)


def _of_shift(code: Reason, accepted: Shift) -> Note:
    return noted(code, about(SubjectKind.SURVEY), move_m=accepted.moves_m, turned_rad=accepted.turn_rad)
