"""`asbuilt-bim measure`: one photo pair, no IFC; faces on the terminal, pictures and JSON in a folder."""

from dataclasses import dataclass
from datetime import datetime
from math import degrees
from pathlib import Path

from rich.table import Table
from rich.text import Text

from asbuilt_bim.codes import SubjectKind
from asbuilt_bim.errors import MeasureError, OptionError, Rejection
from asbuilt_bim.flow.measure_pair import measure_pair
from asbuilt_bim.flow.output.measurement import check_place, save_measurement
from asbuilt_bim.measure.depth_source import Method, depth_method
from asbuilt_bim.measure.pair import PairMeasurement
from asbuilt_bim.measure.station import MeasureOptions
from asbuilt_bim.report.faces_csv import HEADINGS, face_rows
from asbuilt_bim.report.wording.reasons import UNMEASURED, words_of
from asbuilt_bim.report.wording.values import length, plain
from asbuilt_bim.terminal.screen import Screen
from asbuilt_bim.vision.masks.segment import InstanceClass
from asbuilt_bim.vision.stereo.depth import DepthMethod
from asbuilt_bim.vision.stereo.depth_paper import Inversion

TABLE_WIDTH = 124
MOST_UNMEASURED = 3  # faces named one by one: a terminal of thirty warnings is read by nobody
FAILED = 1
"""The exit code where there is no face: the pictures say what was seen, and that is no measurement."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasureRequest:
    """The command line of `measure`, as it was given."""

    left: Path
    right: Path | None  # None: `left` holds both eyes
    rig: tuple[Path, ...]
    out: Path
    rig_cameras: tuple[str, ...] = ()
    target_diameter: float | None = None
    no_target: bool = False
    refine_rig: bool = False
    masks: Path | None = None
    mask_class: tuple[str, ...] = ()
    segment_network: str = ""
    depth_network: str = ""
    method: Method = "default"
    depth: DepthMethod | None = None
    inversion: Inversion = "complement"


def measure_command(request: MeasureRequest, screen: Screen, when: datetime) -> int:
    """Measure a pair, print its faces and write its outputs.

    Raises:
        AsBuiltError: there is no result, with the reason.
    """
    check_place(request.out)
    try:
        options = MeasureOptions(method=request.method, depth=request.depth, inversion=request.inversion)
    except ValueError as problem:
        raise MeasureError(str(problem)) from problem
    if request.depth_network and depth_method(request.method, request.depth) == "stereo":
        raise OptionError("--depth-network isn't used by --depth stereo: pass --depth fused, or drop it")
    found = measure_pair(
        request.left,
        request.right,
        request.rig,
        rig_cameras=request.rig_cameras,
        target_diameter_m=request.target_diameter,
        target=not request.no_target,
        masks=request.masks,
        mask_classes=_classes(request.mask_class),
        segment_network=request.segment_network,
        depth_network=request.depth_network,
        refine_rig=request.refine_rig,
        options=options,
    )
    written = save_measurement(found, request.out, when)
    _show(found, screen)
    if not (request.masks or request.segment_network or request.method == "paper"):
        screen.say(
            "Walls and columns were recognised by shape alone, so slab edges and boards may be among them. "
            "--segment-network bundled asks the shipped network, too."
        )
    screen.say(f"Pictures and numbers: {written[-1]} and {len(written) - 1} files beside it")
    return 0 if found.faces else FAILED


def _largest_first(rejections: list[Rejection]) -> tuple[list[Rejection], int]:
    """Return what to name one by one, the largest few of the faces that can't be measured among it; how many more."""
    unmeasured = [one for one in rejections if one.code in UNMEASURED]
    largest = sorted(unmeasured, key=lambda one: -float(str(one.values.get("area_m2", 0.0))))[:MOST_UNMEASURED]
    rest = [one for one in rejections if one not in unmeasured]
    return [*rest, *largest], len(unmeasured) - len(largest)


def _classes(given: tuple[str, ...]) -> dict[int, InstanceClass]:
    """Read `1=wall` and the like.

    Raises:
        OptionError: it isn't of that form.
    """
    classes: dict[int, InstanceClass] = {}
    for text in given:
        value, _, label = text.partition("=")
        if not value.isdecimal() or len(value) > 5 or label not in ("wall", "column"):
            raise OptionError(
                f"--mask-class {text:.40}: a label and its class are expected, such as 1=wall or 2=column"
            )
        classes[int(value)] = "wall" if label == "wall" else "column"
    return classes


def _show(found: PairMeasurement, screen: Screen) -> None:
    if found.target is not None:
        sigma = length(found.target.depth_m, found.target.depth_sigma_m)
        tape = f"{length(found.target.range_m)} from the left camera, as a tape shows"
        screen.say(f"Target: Z {sigma} ({tape}), diameter {found.target.diameter_m * 1000.0:.0f} mm")
    else:
        screen.say("No target: the scale is the rig's baseline alone, and nothing checks it.")
    if found.options.method == "paper":
        screen.say(
            f"Method: the published one, depth: {found.detail.depth.method}. Areas are those of the faces' shadows on "
            "the image plane; it states no uncertainty."
        )
    elif not found.calibration_known:
        trusted = found.rig.width
        scale = f", {100.0 * trusted.scale_share:.1f} % of every length" if trusted.scale_share else ""
        screen.say(
            "The rig file doesn't say how sure it is: the sigmas below take it to be good to "
            f"{degrees(trusted.turn_rad[1]):.2f} degrees{scale} and {trusted.lens_px:g} px of lens."
        )
    of_rig = [rejection for rejection in found.rejections if rejection.subject.kind is SubjectKind.RIG]
    for rejection in of_rig:  # before the areas that rest on it
        screen.warn(plain(str(words_of(rejection))))
    rows = face_rows(found)
    if screen.width >= TABLE_WIDTH:
        table = Table()
        for heading in HEADINGS:
            table.add_column(heading, justify="left" if heading in ("Class", "Kind", "Sigma from", "Seen") else "right")
        for row in rows:
            table.add_row(*(Text(cell) for cell in row))
        screen.say(table)
    else:
        for number, label, kind, width, height, area, source, seen, flatness, distance in rows:
            screen.say(f"face {number} ({label}, {kind}): {area}, {width} x {height}, {seen}")
            screen.say(f"  sigma from {source}, flatness {flatness}, {distance} away")
    others = [one for one in found.rejections if one not in of_rig]
    named, more = _largest_first(others)
    for rejection in named:
        screen.warn(plain(str(words_of(rejection))))
    if more:
        screen.warn(f"{more} smaller surfaces were seen and can't be measured, either; measure.json names them")
    if not rows:
        share = f"{float(found.detail.depth.valid.mean()):.0%}"
        screen.error(f"not one face was measured; {share} of the left photo has a depth (figures/depth.png)")
