"""A project file drafted from what a folder holds, and what is missing with what to do."""

import json
from collections.abc import Collection, Sequence
from datetime import date
from pathlib import PurePath

from asbuilt_bim.camera.calibration.any_board import SeenBoard
from asbuilt_bim.project.found import FoundFiles, FoundPhotos, FoundVideo

FIRST = "# yaml-language-server: $schema=project-1.schema.json"
"""An editor completes and checks the keys by the schema beside the file, without a network."""


_EXAMPLE = "# EXAMPLE, replace"
_NAMED = 3  # of photos that are left out
_BOARD_EXAMPLE = SeenBoard(kind="charuco", columns=7, rows=9, dictionary="DICT_5X5_100")


def initial_text(name: str, found: FoundFiles) -> str:
    """Return a project file that names all that was found, and has a comment wherever something is missing."""
    lines = [
        FIRST,
        "# Drafted from what lay in this folder. Read it through. What is yours to fill in looks like #target:",
        "# there put your own values in the place of what is marked EXAMPLE, and take the # away.",
        "format: asbuilt-bim/project",
        "version: 1",
        f"name: {_quoted(name)}",
        *_design(found.designs),
        *_rig(found),
        "# The red disc, measured across. It checks the scale.",
        f"#target: {{diameter_m: 0.30}}  {_EXAMPLE}: diameter_m",
        *_markers(found.surveys),
        *_visits(found.visits, found.videos, surveyed=bool(found.surveys)),
    ]
    return "\n".join(lines) + "\n"


def missing(found: FoundFiles) -> tuple[str, ...]:
    """Return what a run still needs, each with what to do."""
    lacks = []
    if not found.designs:
        lacks.append("no IFC file: copy the design into the folder, and name it under ifc")
    if len(found.designs) > 1:
        lacks.append(f"{len(found.designs)} IFC files: keep under ifc those that are the design")
    if not found.rigs and not found.boards and found.factory:
        lacks.append(
            f"photos of a board: {' and '.join(found.factory[0])} is of the camera's maker or another program, and "
            "nobody says how far it is off; areas are surer after 20 pairs of a board in the folder 'calibration' "
            "(asbuilt-bim print board)"
        )
    elif not found.rigs and not found.boards:
        lacks.append(
            "no rig: take 20 pairs of a board into the folder 'calibration' (asbuilt-bim print board), or name a rig "
            "file under rig"
        )
    elif not found.rigs:
        lacks.append(f"the board: {_to_give(found.boards[0].board)}")
    if found.rigs or not found.boards:
        named = [*found.rigs, *(" and ".join(files) for files in found.factory)]
        if len(named) > 1:
            lacks.append(f"{len(named)} rigs ({_some(named)}): keep under rig the one that took these photos")
    lacks.append("the target: measure the disc across, and give diameter_m under target")
    if not found.surveys:
        lacks.append(
            "no survey: markers.csv with the columns id,corner,x_m,y_m,z_m (asbuilt-bim print tags makes the markers); "
            "or give each visit its storey, under near"
        )
    if len(found.surveys) > 1:
        lacks.append(f"{len(found.surveys)} surveys ({_some(found.surveys)}): name under markers the one that counts")
    lacks.append("the markers: measure a black square's side, and give size_m under markers")
    if not found.visits and not found.videos and not found.unreadable:
        lacks.append("no photo pairs of a visit: names need 'left' and 'right', such as A1_left.jpg, A1_right.jpg")
    lacks += [f"the day of {photos.left}: no name and no EXIF tells it" for photos in found.visits if not photos.days]
    if not days_of_exif(found.visits, found.videos):
        lacks += [
            f"the visits of {photos.left}: photos of {_shown(photos.days)} by EXIF; move each day's into a folder"
            for photos in found.visits
            if len(photos.days) > 1
        ]
    lacks += [f"the day of {video.left}: neither its folder nor its name tells it" for video in found.videos
              if not video.day]  # fmt: skip
    if any(not video.right for video in found.videos):
        lacks.append("whether a video holds both eyes side by side (video: {both: ...}), or which is the right eye's")
    return (*lacks, *_left_out(found))


def _left_out(found: FoundFiles) -> list[str]:
    """Return which pictures the draft doesn't name, each with what to do."""
    lacks = []
    if alone := found.photos_alone:
        lacks.append(
            f"{len(alone)} photos are in no pair ({_some(alone)}): their names don't say 'left' and 'right' alike, or "
            "end otherwise. Name them so; or write patterns whose * stands for the same text in both, such as "
            'left: "one/*.jpg", right: "other/*.jpg"'
        )
    if others := found.unreadable:
        what = f"{len(others)} pictures can't be read ({_some(others)})"
        lacks.append(f"{what}: convert them to JPEG, in full size, with their EXIF")
    return lacks


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:_NAMED]) + (" ..." if len(names) > _NAMED else "")


def _design(designs: Sequence[str]) -> list[str]:
    if not designs:
        return ["# The design, an IFC2X3, IFC4 or IFC4X3 file.", "#ifc: design.ifc"]
    if len(designs) == 1:
        return [f"ifc: {_quoted(designs[0])}"]
    return ["# Keep those that are the design.", "ifc:", *(f"  - {_quoted(design)}" for design in designs)]


def _rig(found: FoundFiles) -> list[str]:
    if found.rigs or (found.factory and not found.boards):
        known: list[tuple[str, ...]] = [*((rig,) for rig in found.rigs), *found.factory]
        first, *others = known
        named = (f"  {line}" for line in _files(first))
        return ["rig:", *named, *(f"# or: {{{', '.join(_files(rig))}}}" for rig in others)]
    if not found.boards:
        return [
            "# The calibrated camera: a rig file, or photos of a board.",
            f"#rig: {{file: rig.yaml}}  {_EXAMPLE}: rig.yaml",
        ]
    boards = found.boards[0]
    shown = boards.board or _BOARD_EXAMPLE
    size = f"kind: {shown.kind}, columns: {shown.columns}, rows: {shown.rows}, square_m: 0.034"
    markers = f" marker_m: 0.026, dictionary: {shown.dictionary}," if shown.dictionary else ""
    told = "" if boards.board is None else f" They show {_board_words(boards.board)}: count on the print."
    examples = ["square_m"] + ["marker_m"] * bool(markers)
    if boards.board is None:
        examples = ["kind", "columns", "rows", *examples, "dictionary"]
    return [
        f"# The board: {boards.pairs} pairs were found.{told}",
        f"# EXAMPLE, replace by what you measure or read on your print: {', '.join(examples)}",
        "#rig:",
        f"#  boards: {{{size},{markers}",
        f"#           left: {_quoted(boards.left)}, right: {_quoted(boards.right)}}}",
        *(f"# or, less sure, as the camera came: {{{', '.join(_files(rig))}}}" for rig in found.factory),
    ]


def _files(rig: Sequence[str]) -> list[str]:
    """Name a rig's files under their keys: one, or the left and the right camera's."""
    return [f"{key}: {_quoted(name)}" for key, name in zip(("file", "file_right"), rig, strict=False)]


def _board_words(board: SeenBoard) -> str:
    if board.kind == "chessboard":
        return f"a chessboard of {board.columns} x {board.rows} inner corners"
    return f"a ChArUco board of {board.columns} x {board.rows} squares"


def _to_give(board: SeenBoard | None) -> str:
    side = "a square's side as you measure it on the print"
    if board is None:
        return f"give its kind, columns and rows, and {side}"
    marker = ", and a marker's" if board.dictionary else ""
    return f"the photos show {_board_words(board)}; give {side}{marker}"


def _markers(surveys: Sequence[str]) -> list[str]:
    survey = _quoted(surveys[0]) if surveys else "markers.csv"
    return [
        "# The markers: their survey, and the side of their black square as measured on the print. sigma_m is what a",
        "# surveyed coordinate errs by, in metres: 0.002 to 0.003 by a total station.",
        f"#markers: {{survey: {survey}, size_m: 0.25, sigma_m: 0.003}}  {_EXAMPLE}: size_m, sigma_m",
        *(f"# or the survey: {_quoted(other)}" for other in surveys[1:]),
        "# With a survey that is all. A station that sees fewer than two surveyed tags can be placed by the design:",
        "# give the visit its storey under near, as asbuilt-bim inspect spells it. Survey and near may both be there.",
        "# A rough place of each is better (asbuilt-bim plan shows it so). Stations by patterns have it by name, as in",
        "# near_stations: {U3: {storey: First floor, grid: B-3, looking: north}}",
        "# So a visit of two storeys gives the others' storey. In a list each station has its own near.",
    ]


def _visits(visits: Sequence[FoundPhotos], videos: Sequence[FoundVideo], *, surveyed: bool) -> list[str]:
    if not visits and not videos:
        return [
            "# EXAMPLE, replace: the date, and where its photos lie.",
            "#visits:",
            '#   - {date: 2026-03-02, stations: {left: "visits/2026-03-02/*_left.jpg", '
            'right: "visits/2026-03-02/*_right.jpg"}}',
        ]
    if told := days_of_exif(visits, videos):
        return _by_day(visits[0], told, surveyed=surveyed)
    lines = ["visits:"]
    for photos in sorted(visits, key=lambda one: (one.day is None, str(one.day), one.left)):
        mark = "" if photos.day else "#"
        day = photos.day.isoformat() if photos.day else "YEAR-MONTH-DAY"
        of_days = f" of {_shown(photos.days)}: move each day's into a folder" if len(photos.days) > 1 else ""
        lines.append(f"{mark}  - date: {day}  # {photos.pairs} pair{'' if photos.pairs == 1 else 's'}{of_days}")
        lines += [] if surveyed else [f"#    near: {{storey: Ground floor}}  {_EXAMPLE}: the storey"]
        lines.append(f"{mark}    stations: {{left: {_quoted(photos.left)}, right: {_quoted(photos.right)}}}")
    return lines + _videos(videos, {photos.day for photos in visits})


def days_of_exif(visits: Sequence[FoundPhotos], videos: Sequence[FoundVideo]) -> str:
    """Say of which days the photos are, where the one folder that holds any has several; else "".

    Only then do the days make the visits: beside others, each visit stands in the list with its date.
    """
    if len(visits) != 1 or videos or len(visits[0].days) < 2:
        return ""
    return f"By their EXIF the photos are of {_shown(visits[0].days)}: each day is a visit (dates: exif)."


def _by_day(photos: FoundPhotos, told: str, *, surveyed: bool) -> list[str]:
    return [
        f"# {told} {photos.pairs} pairs.",
        "visits:",
        f"  left: {_quoted(photos.left)}",
        f"  right: {_quoted(photos.right)}",
        "  dates: exif",
        *([] if surveyed else [f"#  near: {{storey: Ground floor}}  {_EXAMPLE}: the storey"]),
    ]


def _shown(days: Sequence[date]) -> str:
    return ", ".join(day.isoformat() for day in days)


def _videos(videos: Sequence[FoundVideo], days: Collection[date | None]) -> list[str]:
    """Return a visit for each walk; behind a # where its day isn't known, or has a visit already."""
    lines, seen = [], set(days)
    for video in sorted(videos, key=lambda one: (one.day is None, str(one.day), one.left)):
        mark = "#" if video.day is None or video.day in seen or not video.right else ""
        seen.add(video.day)
        day = video.day.isoformat() if video.day else "YEAR-MONTH-DAY"
        eyes = f"left: {_quoted(video.left)}, right: {_quoted(video.right)}" if video.right else ""
        lines.append(f"{mark}  - date: {day}  # a walk: its frames become stations")
        lines.append(f"{mark}    video: {{{eyes or f'both: {_quoted(video.left)}'}}}")
    return lines


def _quoted(text: str) -> str:
    """Return text as YAML takes it whatever it holds: JSON's strings are YAML's."""
    return json.dumps(str(PurePath(text).as_posix()), ensure_ascii=False)
