"""A network's card: the small YAML file that says what an ONNX file wants, and what its answers mean."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from asbuilt_bim.errors import NetworkError, ProjectError
from asbuilt_bim.storage.strict_yaml import read_yaml
from asbuilt_bim.storage.structure import Problems, Within, structure

Layout = Literal["mask-rcnn", "yolo-seg", "query", "semantic", "centres", "inverse-depth", "metric-depth", "disparity"]
Meaning = Literal["wall", "column", "other"]
Task = Literal["segment", "depth", "stereo"]

ROLES: dict[str, tuple[str, ...]] = {
    "mask-rcnn": ("boxes", "labels", "scores", "masks"),
    "yolo-seg": ("predictions", "prototypes"),
    "query": ("logits", "masks"),
    "semantic": ("logits",),
    "centres": ("logits", "offsets"),
    "inverse-depth": ("depth",),
    "metric-depth": ("depth",),
    "disparity": ("disparity",),
}
"""The outputs of each layout, in the order in which a network without named outputs is read."""

MIRRORED = ("semantic", "centres", "inverse-depth", "metric-depth")
"""Layouts whose answers are maps, and can be turned back."""

_TASKS: dict[str, Task] = {"inverse-depth": "depth", "metric-depth": "depth", "disparity": "stereo"}


@dataclass(frozen=True, slots=True, kw_only=True)
class InputCard:
    """How a photo becomes the network's input.

    Values are `(pixel / divide - mean) / std`, channel by channel in the order of `colour`.
    """

    width_px: Annotated[int, Within(low=16, high=4096, unit="px")]
    height_px: Annotated[int, Within(low=16, high=4096, unit="px")]
    resize: Literal["stretch", "letterbox", "corner"] = "stretch"  # corner: kept in shape, padded right and below
    pad_value: Annotated[float, Within(low=0, high=255)] = 0.0
    colour: Literal["rgb", "bgr"] = "rgb"
    order: Literal["nchw", "nhwc", "chw"] = "nchw"
    divide: Annotated[float, Within(low=1e-3, high=65535.0)] = 255.0
    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    std: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        """Check what a division needs.

        Raises:
            ValueError: a standard deviation is not positive.
        """
        if min(self.std) <= 0.0:
            raise ValueError(f"std {list(self.std)} must be positive")


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassCard:
    """One class of the network, and what it is here: a wall, a column, or something else that hides concrete."""

    id: Annotated[int, Within(low=0, high=100_000)]
    name: str
    label: Meaning
    blur: bool = False  # people: made unrecognisable in pictures that leave the program

    def __post_init__(self) -> None:
        """Check that only what hides concrete is blurred.

        Raises:
            ValueError: a wall or a column is to be.
        """
        if self.blur and self.label != "other":
            raise ValueError(f"blur: only classes with label other are blurred, {self.name[:40]!r} is a {self.label}")


@dataclass(frozen=True, slots=True, kw_only=True)
class GeometryCard:
    """A second input: what stereo knows of the photo (geometry_input.py), all 0 where there is no stereo."""

    input: str


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkCard:
    """What the YAML file says, key by key."""

    format: Literal["asbuilt-bim/network"]
    version: Literal[1]
    name: str
    file: str
    layout: Layout
    input: InputCard
    outputs: dict[str, str] = field(default_factory=dict)  # role -> the output's name; else by the layout's order
    classes: tuple[ClassCard, ...] = ()
    geometry: GeometryCard | None = None
    offset_px: Annotated[float, Within(low=0.01, high=10_000.0, unit="px")] = 1.0  # an offset of 1, in input pixels
    class_by: Literal["instance", "pixel"] = "instance"  # of the layout centres: who decides on wall or column
    mirror: bool = False  # look at the photo's mirror image too, and take the mean: twice the time
    activation: Literal["sigmoid", "softmax"] = "sigmoid"  # of a query's or a pixel's logits
    least_score: Annotated[float, Within(low=0.0, high=1.0)] = 0.5
    most_overlap: Annotated[float, Within(low=0.0, high=1.0)] = (
        0.5  # boxes of one class that overlap more are one instance
    )
    most_instances: Annotated[int, Within(low=1, high=1000)] = 100
    licence: str | None = None
    source: str | None = None

    def __post_init__(self) -> None:
        """Check what only several keys together can say.

        Raises:
            ValueError: roles or classes don't fit the layout.
        """
        roles = ROLES[self.layout]
        if unknown := sorted(set(self.outputs) - set(roles)):
            raise ValueError(f"outputs.{unknown[0]}: the layout {self.layout} has {', '.join(roles)}")
        if self.outputs and (missing := sorted(set(roles) - set(self.outputs))):
            raise ValueError(f"outputs: {', '.join(missing)} not named; name all of {', '.join(roles)}, or none")
        if self.geometry is not None and (self.task != "segment" or self.input.order != "nchw"):
            raise ValueError("geometry: only a segmenter of order nchw takes it")
        if self.mirror and (self.layout not in MIRRORED or self.input.order == "nhwc"):
            raise ValueError(f"mirror: only the layouts {', '.join(MIRRORED)} of order nchw or chw can have it")
        if self.task == "segment" and not self.classes:
            raise ValueError(
                "classes: none is named; say which of the network's are a wall, a column or something else"
            )
        if self.layout == "centres" and not self.finds_concrete:
            raise ValueError("classes: not one is a wall or a column, which the layout centres divides into things")
        doubled = [number for number, count in Counter(c.id for c in self.classes).items() if count > 1]
        if doubled:
            raise ValueError(f"classes: id {doubled[0]} stands twice")

    @property
    def finds_concrete(self) -> bool:
        """Say whether a segmenter knows walls or columns; one that doesn't only rejects."""
        return any(one.label != "other" for one in self.classes)

    @property
    def task(self) -> Task:
        """Return what the network is for."""
        return _TASKS.get(self.layout, "segment")

    def meaning(self, number: int) -> Meaning | None:
        """Return what class `number` is here, None where the card doesn't name it: it is left aside."""
        return next((c.label for c in self.classes if c.id == number), None)


def read_card(path: Path) -> NetworkCard:
    """Read a network's card; every mistake is named at once.

    Raises:
        NetworkError: the card is missing, no YAML, or wrong.
    """
    if path.suffix.lower() == ".onnx":
        raise NetworkError(f"{path}: is a network, not its card; name the YAML file that describes it")
    try:
        document = read_yaml(path)
    except ProjectError as problem:
        raise NetworkError(f"network card {problem}") from problem
    problems = Problems()
    card: NetworkCard | None = structure(document.value, NetworkCard, problems)
    if card is None or problems.found:
        rows = [f"network card {path}:"]
        rows += [f"  {problem.path or 'the file'}: {problem.text}" for problem in problems.found]
        raise NetworkError("\n".join(rows))
    return card


def model_path(card: NetworkCard, card_path: Path) -> Path:
    """Return where the card's ONNX file lies: in the card's own folder or below it.

    Raises:
        NetworkError: the path leaves the folder, or there is no such file.
    """
    folder = card_path.resolve().parent
    text = card.file.replace("\\", "/")
    try:
        path = folder if "\0" in text else (folder / text).resolve()
        there = path.is_file()
    except OSError as problem:  # a name that no file can have
        raise NetworkError(
            f"network card {card_path}: file '{card.file:.60}' can't be looked for ({problem.strerror}); put the ONNX "
            "file beside the card"
        ) from problem
    if "\0" in text or ":" in text or text.startswith("/") or not path.is_relative_to(folder):
        raise NetworkError(
            f"network card {card_path}: file '{card.file}' leaves the card's folder; put it beside the card"
        )
    if not there:
        raise NetworkError(
            f"network card {card_path}: file '{card.file}' is not there; put the ONNX file beside the card"
        )
    return path
