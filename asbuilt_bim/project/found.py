"""What a folder holds that a project file would name: the design, the rig, board photos, visits, the survey."""

import contextlib
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

from asbuilt_bim.camera.calibration.any_board import SeenBoard, board_shown, shows_board
from asbuilt_bim.camera.photo.read import decode, read_photo
from asbuilt_bim.camera.rig_formats.reader import read_rig_files
from asbuilt_bim.errors import PhotoError, RigError
from asbuilt_bim.project.tables.survey import is_survey

MAX_FILES, MAX_DEPTH = 50_000, 4
_DESIGNS = (".ifc", ".ifczip")
VIDEOS = (".mp4", ".mov", ".avi", ".mkv")
_PHOTOS = (".jpg", ".jpeg", ".png", ".tif", ".tiff")
PICTURES = (*_PHOTOS, ".heic", ".heif", ".webp", ".bmp", ".gif", ".dng", ".cr2", ".cr3", ".nef", ".arw")
"""Photos, and what else people take for one."""
_SIDES = (("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT"), ("links", "rechts"), ("cam0", "cam1"), ("L", "R"))
"""How people tell the two cameras' photos apart, in the order in which it is looked for."""
_BOARDS = re.compile(r"[ck]al(ib|\b|_)|board|chess|schach|charuco", re.IGNORECASE)
_DAYS_OF = 50  # of a folder's photos: a camera's clock goes on, so they show each day that many are of
_LOOKED_AT, _AGREE = 3, 2  # photos of a folder: a wall of tiles is found to be a board now and then
_DAY = re.compile(r"(?<!\d)(20\d\d)[-_.]?(\d\d)[-_.]?(\d\d)(?!\d)")
_OURS = re.compile(r"^format:\s*[\"']?asbuilt-bim/rig", re.MULTILINE)
_HEAD = 4096  # bytes that tell what a text file is
_RIGS = (".conf", ".json", ".yaml", ".yml", ".xml", ".txt")
_LARGEST_RIG, _MOST_RIGS = 200_000, 100  # bytes; files that are looked into


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundPhotos:
    """A folder of photo pairs: patterns of the left and the right ones, how many pairs, and of which days."""

    left: str
    right: str
    pairs: int
    days: tuple[date, ...]  # that of the folder's name, else those of the photos' EXIF
    board: SeenBoard | None = None  # that its photos show, where they are of one

    @property
    def day(self) -> date | None:
        """Return the day where there is one alone."""
        return self.days[0] if len(self.days) == 1 else None


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundVideo:
    """A walk's video: of the left and the right eye, or `right` "" where nobody can tell; the day by its folder."""

    left: str
    right: str
    day: date | None


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundFiles:
    """What was found, by path relative to the folder; each list in the order of names."""

    designs: tuple[str, ...]
    rigs: tuple[str, ...]  # that were calibrated with this program
    factory: tuple[tuple[str, ...], ...]
    """What a bought camera came with or another program made, a file or one of each camera: less sure than boards."""
    boards: tuple[FoundPhotos, ...]
    visits: tuple[FoundPhotos, ...]
    surveys: tuple[str, ...]
    videos: tuple[FoundVideo, ...]
    photos_alone: tuple[str, ...]  # photos of which nobody can tell which camera took them
    unreadable: tuple[str, ...]  # pictures of a kind that isn't read here, such as HEIC


def find_files(folder: Path) -> FoundFiles:
    """Look through a folder, `MAX_DEPTH` deep and at `MAX_FILES` files at most; links are not followed.

    Raises:
        OSError: the folder can't be read.
    """
    files = list(_files(folder))
    photos: dict[Path, list[Path]] = defaultdict(list)
    for file in files:
        if file.suffix.lower() in _PHOTOS:
            photos[file.parent].append(file)
    paired, alone = _all_pairs(folder, photos)
    boards = {place for place, _ in paired if _of_boards(place.relative_to(folder).as_posix(), photos[place])}
    return FoundFiles(
        designs=_named(folder, (f for f in files if f.suffix.lower() in _DESIGNS and ".asbuilt" not in f.name)),
        rigs=_named(folder, (f for f in files if _is_rig(f))),
        factory=tuple(tuple(_named(folder, rig)) for rig in _foreign_rigs(files)),
        boards=tuple(replace(found, board=_board_of(photos[place])) for place, found in paired if place in boards),
        visits=tuple(found for place, found in paired if place not in boards),
        surveys=_named(folder, (f for f in files if f.suffix.lower() == ".csv" and _is_survey(f))),
        videos=tuple(_videos(folder, [f for f in files if f.suffix.lower() in VIDEOS])),
        photos_alone=_named(folder, alone),
        unreadable=_named(
            folder, (f for f in files if f.suffix.lower() in PICTURES and f.suffix.lower() not in _PHOTOS)
        ),
    )


def _of_boards(name: str, photos: Sequence[Path]) -> bool:
    """Say whether a folder holds photos of calibration boards: by its name, else by what two of three photos show."""
    if _BOARDS.search(name):
        return True
    shown = looked = 0
    for file in photos[:: max(1, len(photos) // _LOOKED_AT)][:_LOOKED_AT]:
        with contextlib.suppress(PhotoError):
            shown += shows_board(decode(read_photo(file)))
            looked += 1
        if shown >= _AGREE or looked - shown >= _AGREE:
            break
    return shown >= min(_AGREE, max(looked, 1))


def _board_of(photos: Sequence[Path]) -> SeenBoard | None:
    """Return the largest board that some photos of a folder show: one that shows a part of it shows a smaller one."""
    seen: list[SeenBoard] = []
    for file in photos[:: max(1, len(photos) // _LOOKED_AT)][:_LOOKED_AT]:
        with contextlib.suppress(PhotoError):
            seen += [board] if (board := board_shown(decode(read_photo(file)))) is not None else []
    return max(seen, key=lambda one: one.columns * one.rows, default=None)


def _videos(folder: Path, files: Sequence[Path]) -> Iterable[FoundVideo]:
    """Yield the videos, two that differ by the side's word alone as one walk."""
    taken: set[Path] = set()
    for file in files:
        for left, right in _SIDES:
            word = _word(left)
            partner = file.with_name(word.sub(right, file.name))
            if file not in taken and partner != file and partner in files:
                taken |= {file, partner}
                names = [one.relative_to(folder).as_posix() for one in (file, partner)]
                yield FoundVideo(left=names[0], right=names[1], day=_day_of_name(file))
    for file in files:
        if file not in taken:
            yield FoundVideo(left=file.relative_to(folder).as_posix(), right="", day=_day_of_name(file))


def _day_of_name(file: Path) -> date | None:
    """Return the day that a file's folder or name tells."""
    for text in (file.parent.name, file.name):
        if found := _DAY.search(text):
            with contextlib.suppress(ValueError):
                return date(*(int(part) for part in found.groups()))
    return None


def partner_of(photo: Path) -> tuple[Path, Path] | None:
    """Return the left and the right photo of the pair that one photo is of by its name; None: it says no side."""
    for words in _SIDES:
        for here, word in enumerate(words):
            told = _word(word)
            if told.search(photo.stem):
                other = photo.with_name(told.sub(words[1 - here], photo.stem) + photo.suffix)
                return (other, photo) if here else (photo, other)
    return None


def name_of(left: Path, right: Path) -> str:
    """Return a pair's name: the left photo's without the side's word where the photos' names differ by it alone."""
    pair = partner_of(left)
    if pair is None or (pair[0].name, pair[1].name) != (left.name, right.name):
        return left.stem
    word = next(words[0] for words in _SIDES if _word(words[0]).search(left.stem))
    parts = (part.strip(" _-.") for part in _word(word).split(left.stem))
    return "_".join(part for part in parts if part) or left.stem


def _word(side: str) -> re.Pattern[str]:
    return re.compile(rf"(?<![A-Za-z0-9]){side}(?![A-Za-z0-9])")


def photos_in(folder: Path) -> list[Path]:
    """Return the photos in a folder itself, hidden ones left out, in the order of names.

    Raises:
        OSError: the folder can't be read.
    """
    inside = (one for one in folder.iterdir() if not one.name.startswith("."))
    return sorted(one for one in inside if one.suffix.lower() in _PHOTOS and one.is_file())


def _files(folder: Path) -> Iterable[Path]:
    """Yield the ordinary files below a folder, hidden ones and a run's own folders left out."""
    waiting, count = [(folder, 0)], 0
    while waiting:
        place, depth = waiting.pop(0)
        if (place / "current.json").is_file():
            continue  # the results of an earlier run
        for entry in sorted(place.iterdir()):
            if entry.name.startswith(".") or entry.is_symlink():
                continue
            if entry.is_dir() and depth < MAX_DEPTH:
                waiting.append((entry, depth + 1))
            elif entry.is_file() and count < MAX_FILES:
                count += 1
                yield entry


def _named(folder: Path, files: Iterable[Path]) -> tuple[str, ...]:
    return tuple(file.relative_to(folder).as_posix() for file in files)


def _all_pairs(
    folder: Path, photos: Mapping[Path, Sequence[Path]]
) -> tuple[list[tuple[Path, FoundPhotos]], list[Path]]:
    """Return the pairs by the folder of the left photos, and the photos that are in none."""
    paired: list[tuple[Path, FoundPhotos]] = []
    alone: dict[Path, list[Path]] = {}
    for place in sorted(photos):
        found, used = _pairs(folder, place, photos[place])
        paired += [(place, found)] if found else []
        alone[place] = [file for file in photos[place] if file.name not in used]
    for place in sorted(alone):
        sides = partner_of(place)
        if sides is None or sides[0] != place or sides[1] not in alone:
            continue
        found, used = _folder_pairs(folder, place, sides[1], alone)
        paired += [(place, found)] if found else []
        for side in sides:
            alone[side] = [file for file in alone[side] if file.name not in used]
    return sorted(paired, key=lambda one: one[0]), [file for files in alone.values() for file in files]


def _folder_pairs(
    folder: Path, left: Path, right: Path, alone: Mapping[Path, Sequence[Path]]
) -> tuple[FoundPhotos | None, set[str]]:
    """Return the pairs of two folders, one a camera, where a photo and its partner have one name; and those names."""
    both = {file.name for file in alone[left]} & {file.name for file in alone[right]}
    suffix, count = Counter(Path(name).suffix for name in both).most_common(1)[0] if both else ("", 0)
    if not count:
        return None, set()
    used = {name for name in both if name.endswith(suffix)}
    base = [f"{side.relative_to(folder).as_posix()}/*{suffix}" for side in (left, right)]
    days = _days(left.parent, [left / name for name in sorted(used)])
    return FoundPhotos(left=base[0], right=base[1], pairs=count, days=days), used


def _pairs(folder: Path, place: Path, files: Sequence[Path]) -> tuple[FoundPhotos | None, set[str]]:
    """Return the patterns that most photos of one folder fit in pairs, and these photos' names; None where none do."""
    names = {file.name for file in files}
    best: tuple[int, str, str] | None = None
    for left, right in _SIDES:
        word = _word(left)
        for name in sorted(names):
            for before, after in _patterns(name, word):
                patterns = f"{before}{left}{after}", f"{before}{right}{after}"
                count = len(_stars(names, patterns[0]) & _stars(names, patterns[1]))
                if count and (best is None or count > best[0]):
                    best = count, *patterns
        if best is not None:
            break
    if best is None:
        return None, set()
    base = "" if place == folder else f"{place.relative_to(folder).as_posix()}/"
    stars = _stars(names, best[1]) & _stars(names, best[2])
    lefts, rights = ([pattern.replace("*", star, 1) for star in sorted(stars)] for pattern in best[1:])
    days = _days(place, [place / name for name in lefts])
    return FoundPhotos(left=base + best[1], right=base + best[2], pairs=best[0], days=days), {*lefts, *rights}


def _patterns(name: str, word: re.Pattern[str]) -> Iterable[tuple[str, str]]:
    """Yield what stands before and after the side's word in a pattern: the varying part is before it, or after."""
    for found in word.finditer(name):
        before, after = name[: found.start()], name[found.end() :]
        suffix = Path(name).suffix
        if stem := before.rstrip("_-. "):
            yield "*" + before[len(stem) :], after
        if after != suffix:
            joint = re.match(r"[_\-. ]*", after)
            yield before, (joint.group() if joint else "") + "*" + suffix


def _stars(names: set[str], pattern: str) -> set[str]:
    """Return what stands for the `*` in the names that fit a pattern."""
    fitting = re.compile("(.+)".join(re.escape(part) for part in pattern.split("*")))
    return {found.group(1) for name in names if (found := fitting.fullmatch(name))}


def _days(place: Path, lefts: Sequence[Path]) -> tuple[date, ...]:
    """Return the day that a folder's name tells, else the days that the EXIF of its left photos does."""
    if found := _DAY.search(place.name):
        with contextlib.suppress(ValueError):
            return (date(*(int(part) for part in found.groups())),)
    days = set()
    for file in lefts[:: max(1, len(lefts) // _DAYS_OF)]:
        with contextlib.suppress(PhotoError):
            days.add(read_photo(file).exif.taken)
    return tuple(sorted(day for day in days if day is not None))


def _is_rig(file: Path) -> bool:
    return file.suffix.lower() in (".yaml", ".yml") and bool(_OURS.search(_head(file)))


def _foreign_rigs(files: Sequence[Path]) -> Iterable[tuple[Path, ...]]:
    """Yield the rig files that aren't this program's: each alone, or the left and the right camera's."""
    maybe = [file for file in files if file.suffix.lower() in _RIGS and _may_be_rig(file)][:_MOST_RIGS]
    taken: set[Path] = set()
    for file in maybe:
        if _is_factory(file) or _is_read(file):
            taken.add(file)
            yield (file,)
    for file in maybe:
        for left, right in _SIDES:
            word = re.compile(rf"(?<![A-Za-z0-9]){left}(?![a-z0-9])")  # LeftCameraParams.yaml, cam0/sensor.yaml
            partner = file.parent.with_name(word.sub(right, file.parent.name)) / word.sub(right, file.name)
            if not {file, partner} & taken and partner != file and partner in maybe and _is_read(file, partner):
                taken |= {file, partner}
                yield file, partner


def _may_be_rig(file: Path) -> bool:
    """Say whether a file may be a rig that isn't this program's: by its size, and as it names no format of ours."""
    with contextlib.suppress(OSError):
        return file.stat().st_size <= _LARGEST_RIG and "asbuilt-bim/" not in _head(file)
    return False


def _is_read(*files: Path) -> bool:
    try:
        read_rig_files(files)
    except RigError:
        return False
    return True


def _is_factory(file: Path) -> bool:
    """Say whether a file is a ZED's calibration by its name, or an OAK-D's by its first keys: no size is needed."""
    if re.fullmatch(r"SN\d+\w*\.conf", file.name):
        return True
    return file.suffix.lower() == ".json" and any(key in _head(file) for key in ('"cameraData"', '"left_intrinsics"'))


def _is_survey(file: Path) -> bool:
    return is_survey(_head(file).lstrip("\ufeff").splitlines())


def _head(file: Path) -> str:
    try:
        with file.open("rb") as opened:
            return opened.read(_HEAD).decode("utf-8", "replace")
    except OSError:
        return ""
