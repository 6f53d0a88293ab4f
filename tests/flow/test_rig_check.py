from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.factory import FACTORY
from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.flow.rig_check import SIGNS_OF_KNOCK, Outcome, watch_rig
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.measure.station import RejectedStation
from asbuilt_bim.register.rig_lengths import known_rig
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.reasons import words_of
from tests.register.lengths_seen import visit
from tests.register.test_rig_lengths import area_errors, camera, standing
from tests.vision.stereo.test_rig_health import calibrated, health, turned


def outcomes(turns: Sequence[float]) -> list[Outcome]:
    """Stations S0, S1 ... whose right camera is turned by so many degrees of yaw; nan: says nothing of the rig."""
    found: list[Outcome] = []
    for number, yaw in enumerate(turns):
        name = f"S{number}"
        own = (Rejection(code=Reason.TARGET_ABSENT, subject=Subject(kind=SubjectKind.TARGET, station=name)),)
        seen = None if yaw != yaw else health(name, turned(calibrated(), (0.0, yaw, 0.0)), calibrated(), number)
        found.append(RejectedStation(station=name, rejections=own, health=seen))
    return found


def test_every_station_of_a_visit_with_a_knocked_rig_is_refused_by_the_rig() -> None:
    watched = watch_rig(outcomes([0.2, float("nan"), 0.2]), calibrated())
    told = [[one.code for one in outcome.rejections] for outcome in watched.outcomes]
    assert all(isinstance(outcome, RejectedStation) for outcome in watched.outcomes)
    by_rig = [Reason.RIG_KNOCKED, Reason.TARGET_ABSENT]
    assert told == [by_rig, [Reason.TARGET_ABSENT], by_rig]  # the second says nothing of the rig: its own cause stands
    (record,) = watched.records
    assert record.state == "knocked" and not record.refined and record.yaw_rad == pytest.approx(0.0035, rel=0.05)


def test_a_knock_on_the_way_refuses_the_stations_after_it_and_says_when_it_was() -> None:
    watched = watch_rig(outcomes([0.0, 0.0, 0.3, 0.3]), calibrated())
    knocked = [outcome.rejections[0].code is Reason.RIG_KNOCKED for outcome in watched.outcomes]
    assert knocked == [False, False, True, True]
    (note,) = watched.notes
    assert note.code == Reason.RIG_KNOCKED_BETWEEN
    assert (note.values["last_before"], note.values["first_after"]) == ("S1", "S2")
    assert "between stations S1 and S2" in note_words(note)


def test_with_refining_the_stations_are_measured_again_with_the_rig_that_their_photos_show() -> None:
    asked: list[tuple[list[str], StereoRig]] = []

    def again(names: Sequence[str], rig: StereoRig) -> Mapping[str, Outcome]:
        asked.append((list(names), rig))
        true = turned(calibrated(), (0.0, 0.3, 0.0))
        return {
            name: RejectedStation(station=name, rejections=(), health=health(name, true, rig, seed))
            for seed, name in enumerate(names)
        }

    watched = watch_rig(outcomes([0.3, 0.3, 0.3]), calibrated(), again)
    ((names, rig),) = asked
    assert names == ["S0", "S1", "S2"] and rig.baseline_m == pytest.approx(calibrated().baseline_m, rel=1e-12)
    assert all(not outcome.rejections for outcome in watched.outcomes)
    assert watched.records[0].refined and watched.notes[0].code == Reason.RIG_USED_REFINED


def test_a_sound_rig_changes_nothing() -> None:
    given = outcomes([0.0, 0.0, 0.0])
    watched = watch_rig(given, calibrated())
    assert list(watched.outcomes) == given and watched.warnings == () and watched.notes == ()
    assert watched.records[0].state == "sound"


def test_a_refined_rig_that_its_photos_leave_open_is_measured_with_a_warning() -> None:
    """Of a rig file without covariance nobody knows the lenses, and no area's sigma has them in it."""
    unknown = replace(calibrated(), covariance=frozen(np.zeros((14, 14))))

    def again(names: Sequence[str], rig: StereoRig) -> Mapping[str, Outcome]:
        true = turned(calibrated(), (0.0, 0.3, 0.0))
        return {name: RejectedStation(station=name, rejections=(), health=health(name, true, rig, 1)) for name in names}

    watched = watch_rig(outcomes([0.3, 0.3]), unknown, again)
    assert watched.records[0].refined
    (warning,) = watched.warnings
    assert "rig refined, stations S0 to S1" in str(words_of(warning)) and "asbuilt-bim calibrate" in str(
        words_of(warning)
    )


def test_rows_apart_are_told_by_pair_and_mended_by_pitch_and_roll_alone_where_asked() -> None:
    """A pitch of 0.03 degrees: 0.55 px of rows, and nothing of an area. The yaw stays the calibration's."""
    true = turned(calibrated(), (0.03, 0.0, 0.0))
    given: list[Outcome] = [
        RejectedStation(station=f"S{seed}", rejections=(), health=health(f"S{seed}", true, calibrated(), seed))
        for seed in range(3)
    ]
    (note,) = watch_rig(given, calibrated()).notes
    assert note.code is Reason.RIG_ROWS_APART and "S0 0.5" in note_words(note) and "--refine-rig" in note_words(note)
    asked: list[StereoRig] = []

    def again(names: Sequence[str], rig: StereoRig) -> Mapping[str, Outcome]:
        asked.append(rig)
        return {
            name: RejectedStation(station=name, rejections=(), health=health(name, true, rig, seed))
            for seed, name in enumerate(names)
        }

    watched = watch_rig(given, calibrated(), again)
    (rig,) = asked
    turn = rig.right_from_left[:3, :3] @ calibrated().right_from_left[:3, :3].T
    assert np.rad2deg(turn[2, 1]) == pytest.approx(0.03, abs=0.003)
    assert abs(np.rad2deg(turn[0, 2])) < 0.0015, "a yaw is not mended by rows"
    assert watched.records[0].refined and max(watched.records[0].station_rows_px) == pytest.approx(0.55, abs=0.1)
    mended = [found.fit.rows_px for outcome in watched.outcomes if (found := outcome.health) is not None]
    assert max(mended) < 0.1


@pytest.mark.parametrize("code", sorted(SIGNS_OF_KNOCK))
def test_what_one_station_shows_of_a_knock_gives_way_to_its_visits_verdict(code: Reason) -> None:
    knocked = watch_rig(outcomes([0.2, 0.2]), calibrated()).outcomes[0].rejections[0]
    own = replace(knocked, code=code, values={**knocked.values, "share": 0.5, "matches": -1})
    given = [replace(one, rejections=(own,)) for one in outcomes([0.2, 0.2]) if isinstance(one, RejectedStation)]
    for outcome in watch_rig(given, calibrated()).outcomes:
        (rejection,) = outcome.rejections
        assert rejection.code is Reason.RIG_KNOCKED
        assert rejection.values["matches"] != -1, "the visit's, not the station's own"


def test_known_lengths_move_a_bought_rig_and_the_stations_are_measured_again_and_told_so() -> None:
    bought = replace(calibrated(), covariance=frozen(np.zeros((14, 14))), width=FACTORY)
    true = standing(bought, 0.04, 0.004)
    evidence, known = visit(true, bought, 1, stations=3)
    given: list[Outcome] = [
        RejectedStation(station=f"S{k}", rejections=(), health=health(f"S{k}", true, bought, k), scale=one)
        for k, one in enumerate(evidence)
    ]
    asked: list[StereoRig] = []

    def again(names: Sequence[str], rig: StereoRig) -> Mapping[str, Outcome]:
        asked.append(rig)
        return {
            name: RejectedStation(station=name, rejections=(), health=health(name, true, rig, k))
            for k, name in enumerate(names)
        }

    watched = watch_rig(given, bought, again, known)
    (rig,) = asked
    errors = [np.abs(area_errors(one, true)).max() for one in (known_rig(bought, camera(bought)), rig)]
    assert errors[1] < 0.5 * errors[0] and rig.covariance.any()
    (note,) = watched.notes
    assert note.code is Reason.RIG_REFINED_BY_LENGTHS and "known lengths show it" in note_words(note)
    assert watched.records[0].refined and not watched.warnings
    assert watch_rig(given, bought, None, known).notes == ()
