"""Every reader of what others send, with a valid sample for each of its formats."""

from __future__ import annotations

import gzip
import io
import re
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.calibration.boards import board_of, find_board
from asbuilt_bim.camera.calibration.control_file import read_control_points
from asbuilt_bim.camera.photo.read import decode, read_photo
from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.reader import RigFormat, read_rig, rig_contents
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.project.read import read_project
from asbuilt_bim.project.tables.survey import read_survey
from asbuilt_bim.report.result.document import read_result
from asbuilt_bim.schedule.read import read_schedule
from asbuilt_bim.vision.masks.file import read_masks
from asbuilt_bim.vision.networks.bundled import models_folder
from asbuilt_bim.vision.networks.card import read_card
from asbuilt_bim.vision.networks.session import open_network
from benchmarks.hold.mutate import ANY, mutated
from benchmarks.sites import ROOT, SAMPLE
from tests.camera.rig_formats import written
from tests.camera.test_rig_formats import KALIBR
from tests.camera.virtual import rig
from tests.schedule.files import MSP, P6

CONTROL = "id,x_m,y_m,z_m,left_x,left_y,right_x,right_y\n" + "".join(
    f"P{n},{n % 3},{n % 4},{5 + n % 5},{100 + 50 * n},{90 + 31 * n},{80 + 50 * n},{90 + 31 * n}\n" for n in range(12)
)
PLAN = "id,name,start,finish,globalids\n1,Walls,2026-03-02,2026-03-20,1WallGlobalId000000001\n2,Columns,03.04.2026,,\n"
CLICKS = (
    "polygon,class,x_px,y_px\n1,wall,10,10\n1,wall,90,10\n1,wall,90,80\n2,column,5,5\n2,column,9,5\n2,column,9,60\n"
)
BOARD = "charuco,9x7,0.08,0.06,DICT_5X5_100"
_ENTITY = re.compile(rb"(?m)^#\d+\s*=.*?;\s*$", re.DOTALL)
_WORD = re.compile(rb"#\d+|-?\d+\.\d*(?:E[-+]?\d+)?|'[^'\n]*'|\$|\.[A-Z]+\.|IFC[A-Z0-9]+")
_HEADER = 600  # bytes of a picture: its tables, among which damage is a hard error


@dataclass(frozen=True, slots=True, kw_only=True)
class Sort:
    """One sort of file: its name, its sample, and what reads it; `prepared` puts beside it what it names."""

    name: str
    file: str
    sample: bytes
    read: Callable[[Path], object]
    damaged: Callable[[bytes, np.random.Generator], tuple[str, bytes]]
    beside: dict[str, bytes]


def by_bytes(data: bytes, rng: np.random.Generator) -> tuple[str, bytes]:
    """Damage one to three places."""
    return mutated(data, rng, ANY, times=int(rng.integers(1, 4)))


def by_entity(data: bytes, rng: np.random.Generator) -> tuple[str, bytes]:
    """Exchange, retype, empty or point elsewhere what stands in entities of an IFC text."""
    spots = list(_ENTITY.finditer(data))
    words = [m.group() for m in _WORD.finditer(data)]
    for _ in range(int(rng.integers(1, 5))):
        spot = spots[int(rng.integers(len(spots)))]
        inside = list(_WORD.finditer(data, spot.start(), min(spot.end(), len(data))))[1:]
        if inside:
            old = inside[int(rng.integers(len(inside)))]
            new = words[int(rng.integers(len(words)))]
            data = data[: old.start()] + new + data[old.end() :]
            spots = list(_ENTITY.finditer(data))
    return "entity", data


def _zipped(data: bytes) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("design.ifc", data)
    return packed.getvalue()


def _masks(path: Path) -> object:
    return read_masks(path, (1280, 960), "a.jpg", {1: "wall", 2: "column"})


def _network(path: Path) -> object:
    card = path.with_name("concrete.yaml")
    return open_network(read_card(card), path)


def _board(path: Path) -> object:
    return find_board(decode(read_photo(path)), board_of(BOARD))


def _project_beside() -> dict[str, bytes]:
    names = [path.relative_to(SAMPLE).as_posix() for path in (SAMPLE / "calibration").iterdir()]
    return dict.fromkeys((*names, "markers.csv", "design.ifc"), b"")


def _rigs() -> Iterator[tuple[str, str, bytes, dict[str, bytes], Callable[[Path], object]]]:
    formats: tuple[tuple[RigFormat, str], ...] = (("rig", "rig.yaml"), ("opencv", "rig.yml"))
    for form, file in formats:
        ((_, data),) = rig_contents(rig(), Path(file), form).items()
        yield f"rig: {form}", file, data, {}, read_rig
    yield "rig: kalibr", "chain.yaml", KALIBR.encode(), {}, read_rig
    left, right = rig_contents(rig(), Path("rig.yaml"), "ros").items()
    beside = {right[0].name: right[1]}
    yield "rig: ros", left[0].name, left[1], beside, lambda path: read_rig(path, path.with_name(right[0].name))
    photos = Foreign(photo_px=(1280, 720))
    made = {
        "eyes.conf": written.zed_conf(rig()),
        "listing.m": written.zed_listing(rig()),
        "oak.json": written.oak_eeprom(rig("rational"), by_middle=True),
        "small.json": written.oak_small(rig("rational")),
        "listing.txt": written.realsense_listing(rig()),
        "basalt.json": written.basalt_json(rig("fisheye")),
        "matlab.json": written.matlab_json(rig()),
        "stereo.m": written.bouguet_m(rig()),
        "cameras.xml": written.metashape_xml(rig()),
    }
    for file, text in made.items():
        known = photos if file in ("eyes.conf", "listing.m") else Foreign()
        yield f"rig: {file}", file, text.encode(), {}, lambda path, known=known: read_rig(path, None, known)
    vins = {name: text.encode() for name, text in written.vins_files(rig("fisheye")).items()}
    yield "rig: vins", "config.yaml", vins.pop("config.yaml"), vins, read_rig


@cache
def sorts() -> tuple[Sort, ...]:
    """Return every sort of file."""
    photo = (SAMPLE / "visits/2026-03-02/G1_left.jpg").read_bytes()
    image = cv2.imread(str(SAMPLE / "visits/2026-03-02/G1_left.jpg"))
    assert image is not None
    small = image[300:620, 300:780]
    ifc = (SAMPLE / "design.ifc").read_bytes()
    result = gzip.decompress((ROOT / "tests/report/result/result-1.3.json.gz").read_bytes())
    network, card = ((models_folder() / f"concrete.{end}").read_bytes() for end in ("onnx", "yaml"))
    labels = np.zeros((960, 1280), np.uint8)
    labels[100:400, 200:500], labels[500:700, 800:900] = 1, 2
    board = min((SAMPLE / "calibration").glob("left_*.jpg")).read_bytes()

    def png(array: np.ndarray) -> bytes:
        return bytes(cv2.imencode(".png", array)[1])

    def jpeg(*how: int) -> bytes:
        return bytes(cv2.imencode(".jpg", small, list(how))[1])

    rows: list[tuple[str, str, bytes, dict[str, bytes], Callable[[Path], object]]] = [
        ("project", "project.yaml", (SAMPLE / "project.yaml").read_bytes(), _project_beside(), read_project),
        *_rigs(),
        ("markers", "m.csv", (SAMPLE / "markers.csv").read_bytes(), {}, lambda p: read_survey(p, 0.25, 0.002)),
        ("control points", "c.csv", CONTROL.encode(), {}, read_control_points),
        ("schedule: CSV", "s.csv", PLAN.encode(), {}, read_schedule),
        ("schedule: MS Project", "s.xml", MSP.encode(), {}, read_schedule),
        ("schedule: P6", "s.xml", P6.encode(), {}, read_schedule),
        ("result", "result.json", result, {}, read_result),
        ("masks: CSV", "m.csv", CLICKS.encode(), {}, _masks),
        ("masks: PNG", "m.png", png(labels), {}, _masks),
        ("photo of a camera", "a.jpg", photo, {}, lambda p: decode(read_photo(p))),
        ("photo: progressive", "a.jpg", jpeg(cv2.IMWRITE_JPEG_PROGRESSIVE, 1), {}, lambda p: decode(read_photo(p))),
        ("photo: its header", "a.jpg", jpeg()[:_HEADER] + jpeg()[_HEADER:], {}, lambda p: decode(read_photo(p))),
        ("photo: PNG", "a.png", png(small), {}, lambda p: decode(read_photo(p))),
        ("board photo", "b.jpg", board, {}, _board),
        ("network", "concrete.onnx", network, {"concrete.yaml": card}, _network),
        ("network's card", "concrete.yaml", card, {}, read_card),
        ("IFC by byte", "d.ifc", ifc, {}, read_design),
        ("IFC by entity", "d.ifc", ifc, {}, read_design),
        ("ifczip", "d.ifczip", _zipped(ifc), {}, read_design),
    ]

    def way(name: str) -> Callable[[bytes, np.random.Generator], tuple[str, bytes]]:
        if name == "IFC by entity":
            return by_entity
        if name == "photo: its header":
            return lambda data, rng: (lambda one: (one[0], one[1] + data[_HEADER:]))(by_bytes(data[:_HEADER], rng))
        return by_bytes

    return tuple(
        Sort(name=name, file=file, sample=data, beside=beside, read=read, damaged=way(name))
        for name, file, data, beside, read in rows
    )


def damaged(seed: int) -> tuple[Sort, str, bytes]:
    """Return the case of a seed: the sort of file, what is done to it, and its bytes then."""
    every = sorts()
    sort = every[seed % len(every)]
    done, data = sort.damaged(sort.sample, np.random.default_rng(seed))
    return sort, done, data
