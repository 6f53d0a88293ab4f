"""`asbuilt-bim verify`: is all that a payment rests on still as it was?"""

from collections import Counter
from pathlib import Path

from asbuilt_bim.flow.output.verify import Kind, State, Verified, verify_folder
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.wording.values import plain
from asbuilt_bim.terminal.screen import Screen

CHANGED = 1
_WRONG = ("other", "gone")
_KINDS: dict[Kind, str] = {
    "result": "The current run's result",
    "copy": "Copies of its files in the folder",
    "signed workbook": "Signed workbooks",
    "signed run": "Results that they were signed on",
    "IFC": "The IFC file it was made from",
    "survey": "The survey it was made from",
    "photos": "Photo pairs it measured",
}
_TOLD: dict[State, str] = {
    "other": "is another than it was then",
    "gone": "isn't there",
    "unknown": "can't be said: it is of before digests were kept, or of a video",
    "typed into": "was saved since by a person; what stands in it counts at the next run, or is signed",
}
_TO_DO: dict[Kind, str] = {
    "copy": "`asbuilt-bim report FOLDER` makes all of them again",
    "signed workbook": "put the file back as it was signed, under any name that begins with quantities.signed-",
    "signed run": "put its folder back into runs/ from a backup",
    "IFC": "put it back as it was; another design needs another run",
    "survey": "put it back as it was, or run again; what it was lies in the run's folder, under inputs/",
    "photos": "put them back as the camera stored them",
}
MOST = 20


def verify_command(folder: Path, project: Path | None, screen: Screen, *, allow_outside: bool) -> int:
    """Say of each thing that a run and its certificates rest on whether it is as it was; 1 where something isn't.

    Raises:
        AsBuiltError: there is no run, its result was changed, or the project can't be read.
    """
    found = verify_folder(folder, read_project(project, allow_outside=allow_outside) if project else None)
    for kind, what in _KINDS.items():
        own = [one for one in found if one.kind == kind]
        if not own:
            continue
        same = Counter(one.state for one in own)["same"]
        screen.say(f"{what}: {same} of {len(own)} as {'it was' if len(own) == 1 else 'they were'}")
        others = [one for one in own if one.state != "same"]
        for one in others[:MOST]:
            _tell(one, screen)
        if len(others) > MOST:
            screen.warn(f"  and {len(others) - MOST} more")
        if any(one.state in _WRONG for one in own) and kind in _TO_DO:
            screen.say(f"  What to do: {_TO_DO[kind]}.")
    if project is None:
        screen.say("Photos and survey were not looked at; name the project file with --project")
    return CHANGED if any(one.state in _WRONG for one in found) else 0


def _tell(one: Verified, screen: Screen) -> None:
    where = f" ({plain(one.where)})" if one.where and one.state in _WRONG else ""
    text = f"  {plain(one.name)}: {_TOLD[one.state]}{where}"
    if one.state in _WRONG:
        screen.warn(text)
    else:
        screen.say(text)
