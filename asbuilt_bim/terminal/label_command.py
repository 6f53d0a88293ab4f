"""`asbuilt-bim label`: the current masks of a project's photos, as COCO JSON."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import AsBuiltError, MeasureError, OutputError
from asbuilt_bim.flow.measure_visit import Progress, StationJob, Workplace, lost_station, options_of, read_pair
from asbuilt_bim.flow.output.folder import output_error
from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.flow.video_stations import with_video_stations
from asbuilt_bim.measure.station import RejectedStation, measure_in_detail
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.networks import identities, load_models
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.coco import LabelledPhoto, coco_document, labelled
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.scale.executor import WorkerLoss, run_jobs
from asbuilt_bim.storage.atomic_write import place_problem, replace_bytes
from asbuilt_bim.terminal.open_cache import open_cache
from asbuilt_bim.terminal.screen import Screen


def label_command(path: Path, target: Path, *, workers: int, replace: bool, allow_outside: bool, screen: Screen) -> int:
    """Write the masks of a project's left photos to a COCO file.

    Raises:
        AsBuiltError: the project, its rig or its networks can't be used, or the file can't be written.
    """
    project = read_project(path, allow_outside=allow_outside)
    if target.resolve() in {source.resolve() for source in project.sources}:
        raise OutputError(f"{target}: is a file of the project's; write the labels to another place")
    if problem := place_problem(target):
        raise OutputError(problem)
    if target.exists() and not replace:
        raise OutputError(
            f"{target}: is there already, perhaps with corrections by hand; name another, or pass --replace"
        )
    place = Workplace(workers=workers, cache=open_cache(screen))
    with screen.steps() as progress, with_video_stations(project, place.cache, progress) as visited:
        source = rig_of(visited, place.cache, progress)
        labels = label_project(visited, source.rig, place, progress)
    for name, reason in labels.left_out.items():
        screen.warn(f"{name} was LEFT OUT: {reason}")
    if not labels.photos:
        raise MeasureError(f"not one photo could be labelled, so {target} wasn't written")
    _write(target, json.dumps(coco_document(labels.photos), ensure_ascii=False, indent=1))
    count = sum(len(photo.instances) for photo in labels.photos)
    screen.say(f"{count} masks of {len(labels.photos)} photos are in {target}; correct them in an annotation tool,")
    screen.say("open the photos from the project's folder, and keep the file's name for the corrected ones.")
    return 0


def _write(target: Path, text: str) -> None:
    try:
        replace_bytes(target.resolve(), text.encode())  # a link stays one
    except OSError as problem:
        raise output_error(target, problem, stands="the labels that were there stand") from problem


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Labels:
    """The labelled photos in the project's order, and why others have none, by station."""

    photos: tuple[LabelledPhoto, ...]
    left_out: dict[str, str]


def label_project(project: Project, rig: StereoRig, place: Workplace, progress: Progress) -> Labels:
    """Segment every left photo of a project, as a run would, and keep the masks instead of the areas.

    Raises:
        NetworkError, PluginError: what the project names under `networks` can't be used.
    """
    identities(project.networks)
    options = options_of(project)
    left_out: dict[str, str] = {}
    stations = [station for visit in project.visits for station in visit.stations]
    found: dict[str, LabelledPhoto] = {}

    def jobs() -> Iterator[StationJob]:
        for station in stations:
            photos = read_pair(station, project)
            if isinstance(photos, RejectedStation):
                left_out[station.name] = str(words_of(photos.rejections[0]))
            else:
                yield StationJob(photos=photos, rig=rig, options=options, networks=project.networks)

    for count, done in enumerate(run_jobs(label_job, jobs(), workers=place.workers), start=1):
        photo = done.job.photos.left.name
        if isinstance(done.result, WorkerLoss):
            left_out[photo] = str(words_of(lost_station(done.job.photos.name, done.result).rejections[0]))
        elif isinstance(done.result, str):
            left_out[photo] = done.result
        else:
            found[photo] = done.result
        progress("label", count, len(stations), done.job.photos.name)
    ordered = [name for station in stations if (name := project.relative(station.left)) in found]
    return Labels(photos=tuple(found[name] for name in ordered), left_out=left_out)


def label_job(job: StationJob) -> LabelledPhoto | str:
    """Return a station's left photo with its instances, or why there are none. Runs in a worker process."""
    try:
        detail = measure_in_detail(job.photos, job.rig, job.options, models=load_models(job.networks))
    except AsBuiltError as problem:
        return str(problem)
    if isinstance(detail, RejectedStation):
        return str(words_of(detail.rejections[0]))
    camera = detail.pair.camera
    found = [labelled(instance, job.rig.left, camera) for instance in detail.instances]
    return LabelledPhoto(
        file_name=job.photos.left.name, width_px=job.rig.left.width_px, height_px=job.rig.left.height_px,
        instances=tuple(one for one in found if one.rings),
    )  # fmt: skip
