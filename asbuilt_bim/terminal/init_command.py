"""`asbuilt-bim init`: a project file drafted from what lies in a folder."""

import re
from pathlib import Path

from asbuilt_bim.errors import OutputError
from asbuilt_bim.flow.output.folder import output_error
from asbuilt_bim.project.found import find_files
from asbuilt_bim.project.initial import days_of_exif, initial_text, missing
from asbuilt_bim.storage.atomic_write import place_problem, replace_all
from asbuilt_bim.storage.schemas import schema_bytes
from asbuilt_bim.terminal.screen import Screen

PROJECT, SCHEMA = "project.yaml", "project-1.schema.json"


def init_command(folder: Path, screen: Screen) -> int:
    """Write `project.yaml`, and the schema that an editor checks it by, into a folder that has none.

    Raises:
        OutputError: there is no such folder, it holds a project file, or it can't be read or written.
    """
    target = folder / PROJECT
    if not folder.is_dir():
        raise OutputError(f"{folder}: no such folder; name the one with the IFC file and the photos")
    if target.exists():
        raise OutputError(f"{target}: is there already, and is left as it is; take it away, or go on with it")
    if problem := place_problem(target):
        raise OutputError(problem)
    try:
        found = find_files(folder)
        text = initial_text(folder.absolute().name or "My site", found)
        replace_all({folder / SCHEMA: schema_bytes("project-1"), target: text.encode()})
    except OSError as fault:
        raise output_error(folder, fault, stands="nothing was written") from fault
    pairs = sum(photos.pairs for photos in found.visits)
    counts = (
        _count(len(found.designs), "IFC file"),
        _count(sum(max(1, len(one.days)) for one in found.visits), "visit"),
        _count(pairs, "photo pair"),
    )
    walks = f", {_count(len(found.videos), 'video')}" if found.videos else ""
    screen.say("{}: {}, {} with {}{}.".format(target, *counts, walks))
    if told := days_of_exif(found.visits, found.videos):
        screen.say(told)
    screen.say("Still missing:")
    for number, what in enumerate(missing(found), start=1):
        screen.say(f"  {number}. {what}")
    typed = str(target) if re.fullmatch(r"[\w./\\:~-]+", str(target)) else f'"{target}"'
    screen.say(f"Then: asbuilt-bim run {typed} --out results")
    return 0


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
