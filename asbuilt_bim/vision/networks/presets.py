"""Published networks that people bring: what each wants and answers, its licence, and the card that says so."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.vision.networks.card import ClassCard, InputCard, Layout, Meaning, NetworkCard

_IMAGENET = {"mean": (0.485, 0.456, 0.406), "std": (0.229, 0.224, 0.225)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Preset:
    """A published network: `inputs` and `outputs` by the names in its files; `size_px` where a file leaves it open.

    `outputs` are by role. `card` holds what else its card says. `commercial` is false where its licence forbids paid
    work.
    """

    title: str
    licence: str
    source: str
    layout: Layout
    inputs: tuple[str, ...]
    outputs: Mapping[str, str]
    size_px: tuple[int, int]
    input_keys: Mapping[str, object] = field(default_factory=dict)
    classes: tuple[ClassCard, ...] = ()
    commercial: bool = True

    def card(self, file: str, size_px: tuple[int, int]) -> NetworkCard:
        """Return the card of a file of this network, whose input has this size (width, height)."""
        keys: dict[str, object] = {"width_px": size_px[0], "height_px": size_px[1], **self.input_keys}
        return NetworkCard(
            format="asbuilt-bim/network", version=1, name=self.title, file=file, layout=self.layout,
            input=InputCard(**keys),  # type: ignore[arg-type]
            outputs=dict(self.outputs), classes=self.classes, licence=self.licence, source=self.source,
        )  # fmt: skip


def _classes(label: Meaning, **numbers: int) -> tuple[ClassCard, ...]:
    return tuple(
        ClassCard(id=number, name=name.replace("_", " "), label=label, blur=name == "person")
        for name, number in numbers.items()
    )


PRESETS: dict[str, Preset] = {
    "depth-anything-v2-small": Preset(
        title="Depth Anything V2 small", licence="Apache-2.0", source="https://github.com/DepthAnything/Depth-Anything-V2",
        layout="inverse-depth", inputs=("pixel_values",), outputs={"depth": "predicted_depth"}, size_px=(518, 518),
        input_keys=_IMAGENET,
    ),
    "lite-any-stereo": Preset(
        title="LiteAnyStereo V2", licence="MIT", source="https://github.com/TomTomTommi/LiteAnyStereo",
        layout="disparity", inputs=("left", "right"), outputs={"disparity": "disparity"}, size_px=(640, 480),
        input_keys={"divide": 1.0},
    ),
    "rf-detr-seg-small": Preset(
        title="RF-DETR-seg small", licence="Apache-2.0", source="https://github.com/roboflow/rf-detr",
        layout="query", inputs=("input",), outputs={"logits": "labels", "masks": "masks"}, size_px=(384, 384),
        input_keys=_IMAGENET,
        classes=_classes("other", person=1, bicycle=2, car=3, motorcycle=4, bus=6, train=7, truck=8),
    ),
    "segformer-b0-ade20k": Preset(
        title="SegFormer-B0 ADE20K", licence="NVIDIA Source Code License for SegFormer (non-commercial)",
        source="https://huggingface.co/nvidia/segformer-b0-finetuned-ade-512-512",
        layout="semantic", inputs=("pixel_values",), outputs={"logits": "logits"}, size_px=(512, 512),
        input_keys=_IMAGENET,
        classes=(
            *_classes("wall", wall=0), *_classes("column", column=42),
            *_classes("other", sky=2, tree=4, person=12, plant=17, car=20, fence=32, bus=80, truck=83),
        ),
        commercial=False,
    ),
}  # fmt: skip
"""By the name that `asbuilt-bim networks add` takes."""

PROMPTED = ("mobile-sam", "sam", "sam2", "fast-sam")
"""Networks that answer to clicks or boxes: nobody clicks in a run, and no layout of a card fits them."""


def preset_of(name: str) -> Preset:
    """Return a preset by its name.

    Raises:
        NetworkError: there is none of this name.
    """
    if name in PRESETS:
        return PRESETS[name]
    known = ", ".join(PRESETS)
    if name.lower() in PROMPTED:
        raise NetworkError(
            f"networks add {name}: this network wants clicks or boxes, which a run has none of; known are {known}"
        )
    raise NetworkError(
        f"networks add {name[:40]}: no such preset; known are {known}. Write its card by hand: docs/networks.md"
    )
