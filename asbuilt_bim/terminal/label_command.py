"""`asbuilt-bim label`: the current masks of a project's photos, as COCO JSON."""

from __future__ import annotations

import json
from pathlib import Path

from asbuilt_bim.errors import OutputError
from asbuilt_bim.flow.labels import label_project
from asbuilt_bim.flow.measure_visit import Workplace
from asbuilt_bim.flow.output.folder import output_error
from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.coco import coco_document
from asbuilt_bim.scale.cache import Cache, default_folder
from asbuilt_bim.storage.atomic_write import place_problem, replace_bytes
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
    place = Workplace(workers=workers, cache=Cache(folder=default_folder()))
    with screen.steps() as progress:
        rig, _ = rig_of(project, place.cache, progress)
        labels = label_project(project, rig, place, progress)
    for name, reason in labels.left_out.items():
        screen.warn(f"{name} was LEFT OUT: {reason}")
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
