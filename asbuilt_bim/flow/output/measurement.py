"""The output folder of `measure`: written beside, then put in place; files that are not its own are never touched."""

import contextlib
import json
import shutil
import tempfile
from collections.abc import Iterable
from datetime import datetime
from pathlib import Path

from asbuilt_bim.errors import OutputError
from asbuilt_bim.flow.output.folder import output_error
from asbuilt_bim.measure.pair import PairMeasurement
from asbuilt_bim.report.drawings.figures import figures
from asbuilt_bim.report.drawings.overlay import JPEG_QUALITY, encode_picture
from asbuilt_bim.report.faces_csv import faces_csv
from asbuilt_bim.report.result.measure_document import FORMAT, measure_document
from asbuilt_bim.storage.atomic_write import write_problem
from asbuilt_bim.storage.regular_file import path_of
from asbuilt_bim.storage.strict_json import parse_json

DOCUMENT = "measure.json"
MAX_BYTES = 200_000_000
_STANDS = "nothing of this measurement was kept, and what was in the folder stands"


def save_measurement(found: PairMeasurement, folder: Path | str, when: datetime) -> tuple[Path, ...]:
    """Write `measure.json`, `faces.csv`, `overlay.jpg` and the figures; return their paths, `measure.json` last.

    A folder that holds an earlier measurement is brought up to date; any other file in the way is left alone and named.

    Raises:
        OutputError: a file that isn't an earlier measurement's is in the way, or the folder can't be written.
    """
    folder = path_of(folder, "folder")
    contents = _contents(found)
    document = measure_document(found, when, tuple(contents))
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1) + "\n"
    contents[DOCUMENT] = text.encode("utf-8", "backslashreplace")
    check_place(folder, contents)
    before = _earlier(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=".measure-", suffix=".part", dir=folder))
    except OSError as problem:
        raise output_error(folder, problem, stands=_STANDS) from problem
    try:
        for name, data in contents.items():
            (staging / name).parent.mkdir(exist_ok=True)
            (staging / name).write_bytes(data)
        for name in contents:  # the document comes last: it never speaks of files that aren't there
            (folder / name).parent.mkdir(exist_ok=True)
            (staging / name).replace(folder / name)
    except OSError as problem:
        raise output_error(folder, problem, stands=_STANDS) from problem
    finally:
        shutil.rmtree(staging, ignore_errors=True)
    for name in set(before) - set(contents):
        with contextlib.suppress(OSError):
            (folder / name).unlink()
    return tuple(folder / name for name in contents)


def check_place(folder: Path, names: Iterable[str] = (DOCUMENT,)) -> None:
    """Check that a folder can take a measurement, before anything is measured.

    Raises:
        OutputError: a file that isn't an earlier measurement's is in the way, or it can't be written.
    """
    try:
        if folder.exists() and not folder.is_dir():
            raise OutputError(f"{folder}: is a file; name a folder with --out")
        own = {DOCUMENT, *_earlier(folder)} if (folder / DOCUMENT).exists() else set()
        for name in names:
            if (folder / name).exists() and name not in own:
                raise OutputError(
                    f"{folder / name}: is there and of no earlier measurement; choose another --out folder"
                )
    except OSError as problem:
        raise output_error(folder, problem) from problem
    if (cause := write_problem(folder)) is not None:
        raise OutputError(f"{folder}: can't be written ({cause.strerror}); choose another --out")


def _contents(found: PairMeasurement) -> dict[str, bytes]:
    drawn = figures(found)
    contents = {f"figures/{figure.name}.png": figure.png() for figure in drawn if figure.name != "overlay"}
    overlay = next(figure for figure in drawn if figure.name == "overlay")
    contents["overlay.jpg"] = encode_picture(overlay.image, JPEG_QUALITY)
    contents["faces.csv"] = faces_csv(found)
    return contents


def _earlier(folder: Path) -> list[str]:
    """Return the files that an earlier measurement wrote here, none outside the folder.

    Raises:
        OutputError: there is a `measure.json` of somebody else's.
    """
    path = folder / DOCUMENT
    try:
        if not path.exists():
            return []
        document = parse_json(path.read_bytes()) if path.stat().st_size <= MAX_BYTES else None
    except (OSError, ValueError, RecursionError) as problem:
        raise OutputError(
            f"{path}: is there and is no measurement of this program's; choose another --out"
        ) from problem
    if not isinstance(document, dict) or document.get("format") != FORMAT or document.get("version") != 1:
        raise OutputError(f"{path}: is there and is no measurement of this program's; choose another --out")
    files = document.get("files")
    names = [name for name in files if isinstance(name, str)] if isinstance(files, list) else []
    return [name for name in names if (folder / name).resolve().is_relative_to(folder.resolve())]
