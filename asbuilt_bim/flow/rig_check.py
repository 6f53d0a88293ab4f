"""A visit's rig, judged from all its stations together: used, refined, or the stations refused by name."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import PHOTO_FAULTS, Note, Reason, Subject, SubjectKind, about, noted
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.measure.sigma.rig_scale import ScaleEvidence
from asbuilt_bim.measure.station import RejectedStation, StationMeasurement
from asbuilt_bim.progress.report import RigRecord
from asbuilt_bim.project.model import Project
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.rig_lengths import KnownLengths, LengthsFit, is_worth_it, rig_by_lengths
from asbuilt_bim.register.scale import ScaleVerdict, doubt_rejection, judge_scale, scale_rejection
from asbuilt_bim.vision.stereo.rig_health import (
    SIGNIFICANT,
    RigVerdict,
    StationHealth,
    judge_visit,
    levelled,
    refined_rig,
)
from asbuilt_bim.vision.stereo.rig_rejection import RIG, rig_doubt, rig_rejection

Outcome = StationMeasurement | RejectedStation
MeasureAgain = Callable[[Sequence[str], StereoRig], Mapping[str, Outcome]]
"""Measures the named stations with another rig."""
SIGNS_OF_KNOCK = frozenset(
    {Reason.RIG_KNOCKED, Reason.TARGET_ROWS_APART, Reason.PHOTOS_ROWS_APART, Reason.PHOTOS_BEHIND_RIG}
)
"""What one station alone shows of a knock: its visit's verdict says it better."""
_USED_ALL_THE_SAME = frozenset({Reason.RIG_MOVED, Reason.RIG_UNDETERMINED})
"""Warnings of a rig that was used all the same: one of a wrong scale isn't."""
ROWS_MENDED_PX = 0.3
"""From here on rows are mended where asked: three times what matches of one photo pair scatter by."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WatchedVisit:
    """A visit's outcomes after its rig was judged, warnings and notes on the rig, and the records of the judgement."""

    outcomes: tuple[Outcome, ...]
    warnings: tuple[Rejection, ...]
    records: tuple[RigRecord, ...]
    notes: tuple[Note, ...]
    scale_share: float = 0.0  # by which lengths are doubtful


def watch_rig(
    outcomes: Sequence[Outcome],
    rig: StereoRig,
    again: MeasureAgain | None = None,
    lengths: KnownLengths | None = None,
) -> WatchedVisit:
    """Judge the rig of a visit, whose stations are in the order in which they were taken.

    Stations taken with a knocked rig are refused. With `again` (--refine-rig) they are measured again with the rig that
    their own matches show, and as the visit's known `lengths` do where these know it better. They are refused only
    where that one is no better.
    """
    healths = [health for outcome in outcomes if (health := outcome.health) is not None]
    verdicts = judge_visit(healths, rig)
    found = {outcome.station: outcome for outcome in outcomes}
    warnings: list[Rejection] = []
    records: list[RigRecord] = []
    notes: list[Note] = []
    for verdict, names in _stretches([outcome.station for outcome in outcomes], verdicts):
        evidence = [one for name in names if (one := found[name].scale) is not None]
        better = None if again is None else _better(rig, verdict, _camera(healths, verdict), evidence, lengths)
        if again is not None and better is not None:
            found.update(again(names, better.rig))
            left, state, doubts = _still_knocked([found[name] for name in names], better.rig)
            found.update(left)
            warnings += doubts if better.fit is None else ()  # what matches leave open, the lengths have told
            records.append(_record(verdict, refined=state == "refined"))
            notes += [] if better.mended is None else [_refined(names, better.mended)]
            notes += [] if better.fit is None else [_by_lengths(names, better.fit)]
            continue
        records.append(_record(verdict, refined=False))
        notes += _rows_told(verdict)
        if verdict.state == "knocked":
            found.update({name: _refused(found[name], verdict) for name in names if _is_of(found[name], verdict)})
        doubt = rig_doubt(verdict, names, rig)
        warnings += [doubt] if doubt is not None else []
    notes += [_knocked_between(before, after) for before, after in pairwise(verdicts)]
    return WatchedVisit(
        outcomes=tuple(found[outcome.station] for outcome in outcomes),
        warnings=tuple(warnings), records=tuple(records), notes=tuple(notes),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Better:
    """A rig as a visit shows it: by its matches, by its known lengths, or by both."""

    rig: StereoRig
    mended: RigVerdict | None
    fit: LengthsFit | None


def _better(
    rig: StereoRig,
    verdict: RigVerdict,
    camera: RectifiedCamera,
    evidence: Sequence[ScaleEvidence],
    lengths: KnownLengths | None,
) -> _Better | None:
    """Return the rig as matches and known lengths show it; None where neither asks for another."""
    mended = _mended(verdict, camera)
    found = rig if mended is None else refined_rig(rig, mended, camera)
    fit = None if lengths is None else rig_by_lengths(found, rig, evidence, lengths, camera)
    if fit is not None and is_worth_it(fit):
        return _Better(rig=fit.rig, mended=mended, fit=fit)
    return None if mended is None else _Better(rig=found, mended=mended, fit=None)


def _mended(verdict: RigVerdict, camera: RectifiedCamera) -> RigVerdict | None:
    """Return what --refine-rig mends; None where nothing is to be mended.

    Pitch and roll from a third of a pixel of rows on. The rest only where areas show it against its sigma.
    """
    if verdict.state in ("doubtful", "knocked") and abs(verdict.area_effect) > SIGNIFICANT * verdict.area_sigma:
        return verdict
    return levelled(verdict, camera) if _rows_px(verdict) > ROWS_MENDED_PX else None


def _rows_px(verdict: RigVerdict) -> float:
    return max(verdict.rows_px if verdict.state in ("doubtful", "knocked") else 0.0, *verdict.station_rows_px)


def _rows_told(verdict: RigVerdict) -> list[Note]:
    """Say of each pair how far apart its rows lie, where one's lie further than --refine-rig would leave."""
    if max(verdict.station_rows_px) <= ROWS_MENDED_PX:
        return []
    rows_px, stations = verdict.station_rows_px, verdict.stations
    return [noted(Reason.RIG_ROWS_APART, about(SubjectKind.RIG), stations=stations, pair_rows_px=rows_px)]


def watch_scale(
    watched: WatchedVisit, project: Project, rig: StereoRig, survey: Sequence[SurveyedMarker]
) -> WatchedVisit:
    """Hold a visit's known lengths against the rig: a wrong scale refuses every station, by the mistake's name."""
    evidence = [outcome.scale for outcome in watched.outcomes if outcome.scale is not None]
    verdict = judge_scale(evidence, project.target.diameter_m, project.markers.size_m, survey)
    if verdict is None:
        return watched
    square_m = project.rig.boards.square_m if project.rig.boards is not None else None
    if not verdict.is_wrong:
        doubt = doubt_rejection(RIG, verdict, rig, square_m)
        return watched if doubt is None else _widened(watched, doubt, verdict)
    wrong = [_wrong_scale(outcome, verdict, rig, square_m) for outcome in watched.outcomes]
    left = tuple(one for one in watched.warnings if one.code not in _USED_ALL_THE_SAME)
    return replace(watched, outcomes=tuple(wrong), warnings=left)


def _widened(watched: WatchedVisit, doubt: Rejection, verdict: ScaleVerdict) -> WatchedVisit:
    """Warn of a scale that is off, and let every area's sigma hold what that makes of the area: twice a length's.

    What it makes of places is held by the bounds of completion.
    """
    share = abs(verdict.ratio**2 - 1.0)
    widened = noted(Reason.AREAS_WIDENED, about(SubjectKind.RIG), share=share)
    return replace(
        watched,
        outcomes=tuple(_wider(outcome, share) for outcome in watched.outcomes),
        warnings=(doubt, *watched.warnings),
        notes=(*watched.notes, widened),
        scale_share=abs(verdict.ratio - 1.0),
    )


def _wider(outcome: Outcome, share: float) -> Outcome:
    if isinstance(outcome, RejectedStation):
        return outcome
    return replace(outcome, faces=tuple(face.of_wider_scale(share) for face in outcome.faces))


def _wrong_scale(outcome: Outcome, verdict: ScaleVerdict, rig: StereoRig, square_m: float | None) -> Outcome:
    """Refuse a station that was read; one that couldn't be keeps its own reasons."""
    if outcome.scale is None:
        return outcome
    reason = scale_rejection(_subject(outcome), verdict, rig, square_m)
    return replace(refused(outcome, reason), health=outcome.health, scale=outcome.scale)


def refused(outcome: Outcome, reason: Rejection) -> RejectedStation:
    """Return a station as refused for one reason, with what is wrong with its photos; it says nothing of the rig."""
    picture = outcome.picture if isinstance(outcome, RejectedStation) else decoded(outcome.thumbnail_jpeg)
    return RejectedStation(station=outcome.station, rejections=(*_photo_faults(outcome), reason), picture=picture)


def _photo_faults(outcome: Outcome) -> tuple[Rejection, ...]:
    """Return what is wrong with a station's photos: it may be the cause of the rest, and is named first."""
    return tuple(one for one in outcome.rejections if one.code in PHOTO_FAULTS)


def _stretches(names: Sequence[str], verdicts: Sequence[RigVerdict]) -> list[tuple[RigVerdict, list[str]]]:
    """Return each verdict with all its stations: one that says nothing of the rig goes with the one before it."""
    if not verdicts:
        return []
    by_name = {name: i for i, verdict in enumerate(verdicts) for name in verdict.stations}
    groups: list[list[str]] = [[] for _ in verdicts]
    current = 0
    for name in names:
        current = by_name.get(name, current)
        groups[current].append(name)
    return list(zip(verdicts, groups, strict=True))


def _is_of(outcome: Outcome, verdict: RigVerdict) -> bool:
    """Say whether a verdict is on a station: one refused before that says nothing of the rig has a cause of its own."""
    return outcome.station in verdict.stations or not isinstance(outcome, RejectedStation)


def _still_knocked(
    outcomes: Sequence[Outcome], rig: StereoRig
) -> tuple[dict[str, Outcome], str, tuple[Rejection, ...]]:
    """Refuse what a refined rig doesn't fit either; warn where its photos leave it open how it stands."""
    verdicts = judge_visit([outcome.health for outcome in outcomes if outcome.health is not None], rig)
    bad = {name: verdict for verdict in verdicts if verdict.state == "knocked" for name in verdict.stations}
    refused: dict[str, Outcome] = {o.station: _refused(o, bad[o.station]) for o in outcomes if o.station in bad}
    doubts = [rig_doubt(verdict, verdict.stations, rig, refined=True) for verdict in verdicts]
    told = tuple(doubt for doubt in doubts if doubt is not None)
    return refused, "not refined" if refused else "refined", told


def _refused(outcome: Outcome, verdict: RigVerdict) -> RejectedStation:
    """Return a station's rejection by its visit's verdict; what else was wrong with it stays."""
    own = outcome.rejections if isinstance(outcome, RejectedStation) else ()
    others = tuple(one for one in own if one.code not in SIGNS_OF_KNOCK | PHOTO_FAULTS)
    return RejectedStation(
        station=outcome.station,
        rejections=(*_photo_faults(outcome), rig_rejection(Reason.RIG_KNOCKED, _subject(outcome), verdict), *others),
        picture=outcome.picture if isinstance(outcome, RejectedStation) else decoded(outcome.thumbnail_jpeg),
        health=outcome.health,
        scale=None,  # a knock moves lengths too: its scale says nothing more
    )


def decoded(jpeg: bytes) -> ByteImage | None:
    """Return a kept picture; None where there is none, or it can't be decoded."""
    picture = cv2.imdecode(np.frombuffer(jpeg, dtype=np.uint8), cv2.IMREAD_COLOR) if jpeg else None
    return None if picture is None else np.asarray(picture, dtype=np.uint8)


def _record(verdict: RigVerdict, *, refined: bool) -> RigRecord:
    sigma = np.sqrt(np.diag(verdict.covariance))
    return RigRecord(
        stations=verdict.stations,
        state=verdict.state,
        refined=refined,
        pitch_rad=float(verdict.correction_rad[0]),
        yaw_rad=float(verdict.correction_rad[1]),
        roll_rad=float(verdict.correction_rad[2]),
        pitch_sigma_rad=float(sigma[0]),
        yaw_sigma_rad=float(sigma[1]),
        roll_sigma_rad=float(sigma[2]),
        area_effect=verdict.area_effect,
        area_effect_sigma=verdict.area_sigma,
        rows_px=verdict.rows_px,
        station_rows_px=verdict.station_rows_px,
        matches=verdict.matches,
    )


def _refined(names: Sequence[str], verdict: RigVerdict) -> Note:
    """Say that stations were measured with the rig as their photos show it."""
    turn, sigma = _turn(verdict)
    return noted(
        Reason.RIG_USED_REFINED,
        about(SubjectKind.RIG),
        stations=tuple(names),
        matches=verdict.matches,
        turn_rad=turn,
        turn_sigma_rad=sigma,
        area_effect=verdict.area_effect,
        area_effect_sigma=verdict.area_sigma,
        rows_px=verdict.rows_px,
    )


def _by_lengths(names: Sequence[str], fit: LengthsFit) -> Note:
    """Say that stations were measured with the rig as known lengths show it."""
    return noted(
        Reason.RIG_REFINED_BY_LENGTHS,
        about(SubjectKind.RIG),
        stations=tuple(names),
        lengths=fit.count,
        yaw_rad=fit.yaw_rad,
        yaw_sigma_rad=fit.yaw_sigma_rad,
        scale=fit.scale,
        scale_sigma=fit.scale_sigma,
        area_sigma_before=fit.area_sigma_before,
        area_sigma=fit.area_sigma,
    )


def _knocked_between(before: RigVerdict, after: RigVerdict) -> Note:
    """Say between which stations the rig was knocked, and how it stood before and after."""
    turn_before, sigma_before = _turn(before)
    turn_after, sigma_after = _turn(after)
    return noted(
        Reason.RIG_KNOCKED_BETWEEN,
        about(SubjectKind.RIG),
        last_before=before.stations[-1],
        first_after=after.stations[0],
        turn_before_rad=turn_before,
        turn_before_sigma_rad=sigma_before,
        turn_after_rad=turn_after,
        turn_after_sigma_rad=sigma_after,
    )


def _turn(verdict: RigVerdict) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the right camera's pitch, yaw and roll, and their sigma."""
    sigma = np.sqrt(np.diag(verdict.covariance)[:3])
    return tuple(float(angle) for angle in verdict.correction_rad[:3]), tuple(float(one) for one in sigma)


def _camera(healths: Sequence[StationHealth], verdict: RigVerdict) -> RectifiedCamera:
    return next(health.camera for health in healths if health.station in verdict.stations)


def _subject(outcome: Outcome) -> Subject:
    return about(SubjectKind.STATION, outcome.station)
