"""What a check on site says of today's photos: every fault by name, in the words of a run, and nothing of good ones."""

from __future__ import annotations

import shutil
from dataclasses import replace
from datetime import date
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result

from asbuilt_bim.camera.rig_formats.reader import read_rig
from asbuilt_bim.cli import app
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import NetworkError
from asbuilt_bim.flow.check_places import PlacedBy
from asbuilt_bim.flow.check_visit import check_stations, day_of
from asbuilt_bim.flow.measure_visit import Workplace, measure_stations, read_pair
from asbuilt_bim.measure.station import RejectedStation, StationMeasurement
from asbuilt_bim.progress.visits.checked import CheckedStation, CheckedVisit
from asbuilt_bim.project.model import Project, Visit
from asbuilt_bim.project.networks import identities
from asbuilt_bim.project.photos import stations_of
from asbuilt_bim.project.read import read_project
from asbuilt_bim.project.tables.places import KnownPlaces, survey_of
from asbuilt_bim.report.wording.of_page.check_words import aspect_reasons, aspect_words, grade_words, verdict_words
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.scale.cache import Cache
from tests.photo_damage import _rewrite
from tests.site_fixture import contents, rig_file, shared_cache, site, small_project, write
from tests.vision.networks import graphs

TODAY = date(2026, 3, 20)


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Project:
    folder = tmp_path_factory.mktemp("project")
    return read_project(write(folder, small_project(folder, rig_file(tmp_path_factory), stations=1)))


def photos(folder: Path, *names: str) -> Path:
    """Copy stations of the sample's last visit as a camera's folder of today."""
    folder.mkdir()
    for station in contents()["visits"][-1]["stations"]:
        if station["name"] in names:
            for side in ("left", "right"):
                shutil.copyfile(site() / station[side], folder / f"{station['name']}_{side}.jpg")
    return folder


def check(project: Project, folder: Path) -> CheckedVisit:
    rig = read_rig(project.folder / "rig.yaml")
    known = KnownPlaces(survey=survey_of(project))
    by = PlacedBy(known=known)
    return check_stations(stations_of([folder], project), project, rig, by, TODAY, lambda *_: None, workers=1)


def why(station: CheckedStation) -> set[Reason]:
    return {reason.code for aspect in station.aspects for reason in aspect.reasons if aspect.grade != "ok"}


@pytest.fixture(scope="module")
def visit(project: Project, tmp_path_factory: pytest.TempPathFactory) -> CheckedVisit:
    """A good station; one with exchanged photos, one whose disc is covered, one whose tags are, one out of focus."""
    folder = photos(tmp_path_factory.mktemp("camera") / "today", "G1", "G2", "G5")
    for side in ("left", "right"):
        for name in ("disc", "tags", "blur"):
            shutil.copyfile(folder / f"G5_{side}.jpg", folder / f"{name}_{side}.jpg")
        _rewrite(folder / f"disc_{side}.jpg", without_red)
        _rewrite(folder / f"blur_{side}.jpg", lambda image: cv2.GaussianBlur(image, (0, 0), 3.0))
        _rewrite(folder / f"tags_{side}.jpg", without_tags)
        (folder / f"G5_{side}.jpg").unlink()
    left, right, held = (folder / f"G2_{side}.jpg" for side in ("left", "right", "held"))
    left.rename(held)
    right.rename(left)
    held.rename(right)
    return check(project, folder)


def without_red(image: np.ndarray) -> np.ndarray:
    """Hang grey cloth over all that is red."""
    blue, green, red = (channel.astype(int) for channel in cv2.split(image))
    mask = ((red > 90) & (red > 2 * blue) & (red > 2 * green)).astype(np.uint8)
    changed = image.copy()
    changed[cv2.dilate(mask, np.ones((15, 15), np.uint8)) > 0] = 110
    return changed


def without_tags(image: np.ndarray) -> np.ndarray:
    """Cover all tags."""
    finder = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11))
    changed = image.copy()
    for corners in finder.detectMarkers(image)[0]:
        cv2.fillConvexPoly(changed, corners.reshape(4, 2).astype(int), (120, 120, 120))
    return changed


def by_name(visit: CheckedVisit, name: str) -> CheckedStation:
    return next(station for station in visit.stations if station.name == name)


def test_a_good_station_counts_and_nothing_is_said_of_it(visit: CheckedVisit) -> None:
    good = by_name(visit, "G1")
    assert good.counts and good.grade == "ok" and not why(good) and good.picture
    assert all(aspect.grade == "ok" and aspect.values for aspect in good.aspects)


@pytest.mark.parametrize(
    ("name", "reason", "aspect"),
    [
        ("G2", Reason.PHOTOS_OF_OTHER_SIDES, "pair"),
        ("disc", Reason.TARGET_ABSENT, "disc"),
        ("tags", Reason.MARKERS_TOO_FEW, "place"),
        ("blur", Reason.PHOTO_UNSHARP, "photos"),
    ],
)
def test_a_fault_of_the_photos_is_named_and_stands_with_what_it_is_of(
    visit: CheckedVisit, name: str, reason: Reason, aspect: str
) -> None:
    station = by_name(visit, name)
    assert reason in why(station)
    assert next(one for one in station.aspects if one.aspect == aspect).grade in ("not", "doubtful")
    assert station.grade != "ok"
    assert name == "blur" or name in visit.again


def test_exchanged_files_are_named_with_what_to_do_and_no_new_photo_is_asked_for(visit: CheckedVisit) -> None:
    (reason,) = next(one.reasons for one in by_name(visit, "G2").aspects if one.aspect == "pair")
    words = str(words_of(reason))
    assert "G2_left.jpg and " in words and "G2_right.jpg each other's name" in words
    assert visit.by_name == ("G2",)
    verdict = verdict_words(visit)
    assert "Put the files of G2 right and check again." in verdict
    assert "Take " in verdict and "G2" not in verdict.partition("Take ")[2].partition(" again")[0]


def test_an_eye_that_is_missing_is_named_by_side_and_file(project: Project, tmp_path: Path) -> None:
    folder = photos(tmp_path / "today", "G1", "G2")
    (folder / "G2_right.jpg").unlink()
    missing = read_pair(stations_of([folder], project)[1], project)
    assert isinstance(missing, RejectedStation)
    (reason,) = missing.rejections
    assert reason.code is Reason.PHOTO_MISSING and reason.values["side"] == "right"
    words = str(words_of(reason))
    assert "its right photo is missing: there is no" in words and "G2_right.jpg" in words


@pytest.mark.parametrize("there", ["left", "right"])
def test_a_photo_alone_says_its_day(project: Project, tmp_path: Path, there: str) -> None:
    folder = photos(tmp_path / "today", "G1")
    (folder / f"G1_{'left' if there == 'right' else 'right'}.jpg").unlink()
    found = check(project, folder)
    day = next(one for one in found.stations[0].aspects if one.aspect == "day")
    assert aspect_words(day) == "2026-03-16" and found.day == date(2026, 3, 16)
    assert day_of(stations_of([folder], project), TODAY) == found.day and why(found.stations[0])


def test_the_day_is_that_of_the_photos_and_todays_only_where_they_tell_none(visit: CheckedVisit) -> None:
    assert visit.day == date(2026, 3, 16)


def test_a_check_says_of_a_station_what_its_measurement_would(
    project: Project, visit: CheckedVisit, tmp_path_factory: pytest.TempPathFactory
) -> None:
    station, rig = project.visits[0].stations[0], read_rig(project.folder / "rig.yaml")
    place = Workplace(workers=1, cache=Cache(folder=shared_cache(tmp_path_factory)))
    measured = measure_stations([station], "measure", project, rig, place, lambda *_: None)[station.name]
    assert isinstance(measured, StationMeasurement)
    tags = next(one for one in by_name(visit, "G1").aspects if one.aspect == "tags")
    assert tags.values["tags"] == tuple(marker.marker_id for marker in measured.markers)


def dated(project: Project, day: date, **changes: object) -> Project:
    """Return the project with all its stations in one visit of a day."""
    stations = tuple(station for visit in project.visits for station in visit.stations)
    return replace(project, visits=(Visit(date=day, stations=stations),), **changes)  # type: ignore[arg-type]


def test_copies_of_photos_that_the_project_has_are_told_so_and_without_a_day_of_their_own_refused(
    project: Project, tmp_path: Path
) -> None:
    (station,) = project.visits[-1].stations
    folder = tmp_path / "card"
    folder.mkdir()
    for side, path in (("left", station.left), ("right", station.right)):
        assert path is not None
        shutil.copyfile(path, folder / f"again_{side}.jpg")
    told = check(project, folder)
    (note,) = [one for one in told.notes if one.code is Reason.PHOTOS_IN_PROJECT]
    assert note.values["stations"] == (f"{station.name} of {project.visits[-1].date.isoformat()}",)
    undated = tmp_path / "undated"
    undated.mkdir()
    for side in ("left", "right"):
        image = cv2.imdecode(np.fromfile(folder / f"again_{side}.jpg", np.uint8), cv2.IMREAD_COLOR)
        cv2.imwrite(str(undated / f"own_{side}.png"), image)
        shutil.copyfile(undated / f"own_{side}.png", undated / f"copy_{side}.png")
    own = replace(station, left=undated / "own_left.png", right=undated / "own_right.png")
    older = replace(project, visits=(replace(project.visits[-1], stations=(own,)),))
    for side in ("left", "right"):
        (tmp_path / "today").mkdir(exist_ok=True)
        shutil.move(undated / f"copy_{side}.png", tmp_path / "today" / f"copy_{side}.png")
    (copy,) = check(older, tmp_path / "today").stations
    assert Reason.PHOTOS_OF_OTHER_STATION in why(copy)


def test_photos_that_no_visit_of_the_project_is_of_will_not_just_count(project: Project, tmp_path: Path) -> None:
    folder = photos(tmp_path / "today", "G1")
    late = check(dated(project, date(2026, 3, 19)), folder)
    assert late.other_visits == (date(2026, 3, 19),) and late.counting == 1
    verdict = verdict_words(late)
    assert "will count once the project file has a visit of 2026-03-16. It has 2026-03-19." in verdict
    assert check(dated(project, date(2026, 3, 17)), folder).other_visits is None, "a camera's clock may be a day off"


def test_photos_that_the_project_gives_another_day_are_its_mistake_and_not_the_photos(project: Project) -> None:
    wrong = dated(project, date(2026, 3, 25))
    (station, *_) = wrong.visits[0].stations
    rig, by = read_rig(project.folder / "rig.yaml"), PlacedBy(known=KnownPlaces(survey=survey_of(project)))
    found = check_stations([station], wrong, rig, by, TODAY, lambda *_: None, workers=1)
    (checked,) = found.stations
    assert not found.counting and found.by_file == (station.name,)
    grades = {one.aspect: grade_words(one) for one in checked.aspects}
    assert grades["day"] == "wrong in the project file" and grades["photos"] == grades["disc"] == grades["tags"] == "ok"
    assert any("2026-03-25" in str(words_of(fault)) for fault in found.faults)
    assert "Your photos are fine" in verdict_words(found)


def test_a_wrong_diameter_in_the_file_is_told_as_that_and_the_tags_stay_read(project: Project, tmp_path: Path) -> None:
    wrong = replace(project, target=replace(project.target, diameter_m=0.25))
    found = check(wrong, photos(tmp_path / "today", "G1"))
    (station,) = found.stations
    grades = {one.aspect: grade_words(one) for one in station.aspects}
    assert grades["disc"] == "wrong in the project file" and grades["tags"] == "ok"
    assert "correct the project file" in verdict_words(found) and "Don't leave" not in verdict_words(found)
    assert all("check target.diameter_m" in str(reason) for reason in aspect_reasons(station))


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["check", *(str(a) for a in arguments)])


def test_the_command_writes_a_page_and_fails_where_nothing_counts(project: Project, tmp_path: Path) -> None:
    folder = photos(tmp_path / "today", "G1")
    page = tmp_path / "check.html"
    good = run(folder, "--project", project.path, "--out", page, "--workers", 1, "--strict")
    assert good.exit_code == 0, good.output
    assert "The station will count." in good.output and b"data:image/jpeg" in page.read_bytes()
    assert "put up the tags T1, T2" in " ".join(good.output.split()) and "\n  T1: On " in good.output
    (folder / "G1_right.jpg").unlink()
    (folder / "G2_left.jpg").write_bytes(b"no photo")
    (folder / "G2_right.jpg").write_bytes(b"no photo")
    bad = run(folder, "--project", project.path, "--out", page, "--workers", 1)
    assert bad.exit_code == 1 and "Not one station would count" in bad.output
    assert "will not count" in page.read_text(encoding="utf-8"), "its own page is replaced"


def test_a_file_of_somebody_elses_is_not_written_over(project: Project, tmp_path: Path) -> None:
    other = tmp_path / "check.html"
    other.write_text("mine", encoding="utf-8")
    done = run(photos(tmp_path / "today", "G1"), "--project", project.path, "--out", other)
    assert done.exit_code == 1 and "is no page of this command's" in done.output
    assert other.read_text(encoding="utf-8") == "mine"


def test_a_folder_without_photos_is_refused_in_one_line(project: Project, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    done = run(tmp_path / "empty", "--project", project.path, "--out", tmp_path / "page.html")
    assert done.exit_code == 1 and "holds no photos" in done.output
    (tmp_path / "a.jpg").touch()
    lone = run(tmp_path / "a.jpg", "--project", project.path, "--out", tmp_path / "page.html")
    assert lone.exit_code == 2 and "a.jpg alone is no pair" in lone.output


@pytest.mark.parametrize("broken", ["", "no network"])
def test_a_network_that_a_run_would_refuse_is_refused_before_anybody_leaves(
    project: Project, tmp_path: Path, broken: str
) -> None:
    folder = shutil.copytree(project.folder, tmp_path / "site")
    card = graphs.card(folder, broken.encode(), "semantic")
    if not broken:
        (folder / "tiny.onnx").unlink()
    written = yaml.safe_load(project.path.read_text(encoding="utf-8")) | {"networks": {"segment": card.name}}
    file = write(folder, written)
    with pytest.raises(NetworkError) as of_the_run:
        identities(read_project(file).networks)
    done = run(photos(tmp_path / "today", "G1"), "--project", file, "--out", tmp_path / "page.html")
    assert done.exit_code == 1 and f"error: {of_the_run.value}" in done.output
    assert "tiny.onnx" in done.output and not (tmp_path / "page.html").exists()


def test_a_survey_that_a_run_would_refuse_is_refused_before_anybody_leaves(project: Project, tmp_path: Path) -> None:
    folder = shutil.copytree(project.folder, tmp_path / "site")
    assert project.survey is not None
    survey = folder / project.survey.relative_to(project.folder)
    head, *rows = survey.read_text(encoding="utf-8").split()
    on_map = [[*row.split(",")[:2], *(f"{float(cell) + 1e5:.4f}" for cell in row.split(",")[2:])] for row in rows]
    survey.write_text("\n".join([head, *map(",".join, on_map)]), encoding="utf-8")
    file, page = str(folder / project.path.name), str(tmp_path / "page.html")
    checked = run(photos(tmp_path / "today", "G1"), "--project", file, "--out", page)
    planned = CliRunner().invoke(app, ["plan", "--project", file, "--out", page])
    for done in (checked, planned):
        assert done.exit_code == 1 and "lie further than 200 m from the building" in done.output


def test_the_plan_command_lists_as_many_stations_as_asked_for_and_writes_the_page(
    project: Project, tmp_path: Path
) -> None:
    page = tmp_path / "plan.html"
    common = ["plan", "--project", str(project.path), "--date", "2026-03-02"]
    done = CliRunner().invoke(app, [*common, "--stations", "2", "--out", str(page)])
    assert done.exit_code == 0, done.output
    assert "2. " in done.output and "3. Ground" not in done.output and "2 stations show" in done.output
    assert b"asbuilt-bim plan" in page.read_bytes()[:2048]
    (tmp_path / "none").mkdir()
    no_run = CliRunner().invoke(app, [*common, "--result", str(tmp_path / "none"), "--out", str(page)])
    assert no_run.exit_code == 1 and "holds no run" in no_run.output
    checked = run(photos(tmp_path / "today", "G1"), "--project", project.path, "--out", page)
    assert checked.exit_code == 1 and "is no page of this command's" in checked.output
