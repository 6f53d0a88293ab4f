"""The command `finetune`: the shipped segmenter learns from a user's own photos and labels.

It goes on from the shipped weights, batch norms folded in, for a few minutes: with few photos there is little to learn
and much to forget. Every fifth photo is kept back to judge by. Only photos are given, so what the network knows of
stereo isn't trained further.
"""

from __future__ import annotations

import argparse
import logging
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from asbuilt_bim.errors import AsBuiltError
from torch.nn import functional

from asbuilt_training.averaged import Averaged
from asbuilt_training.classes import CLASSES
from asbuilt_training.export import WIDTH_PX, write_segmenter
from asbuilt_training.folded import Segmenter, read_segmenter
from asbuilt_training.loader import collate
from asbuilt_training.losses import OFFSET_WEIGHT, class_loss, offset_loss
from asbuilt_training.model import network_inputs
from asbuilt_training.own_labels import OwnLabels, read_labels
from asbuilt_training.samples import Recipe, training_sample
from asbuilt_training.shards import Picture

LOG = logging.getLogger(__name__)
SHIPPED = Path(__file__).resolve().parents[2] / "asbuilt_bim" / "models" / "concrete.onnx"
KEPT_BACK = 5
"""One photo of so many is kept back, where there are so many."""
BATCH = 6
RECIPE = Recipe(without_geometry=1.0, least_crop=0.5)
_LIKE = (("form", 4), ("schal", 4), ("slab", 3), ("beam", 3), ("stair", 3), ("decke", 3))
"""Which shipped class a class of another name starts from; else from `other`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Overlap:
    """IoU on some photos; NaN where there is neither truth nor answer."""

    concrete: float
    wall: float
    column: float


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's own arguments."""
    parser.add_argument("--labels", type=Path, required=True, help="COCO JSON, such as `asbuilt-bim label` writes it")
    parser.add_argument("--photos", type=Path, required=True, help="folder that the file's names go by")
    parser.add_argument("--out", type=Path, required=True, help="folder for the network, its card and figures")
    parser.add_argument("--name", default="own", help="the network's name (default: own)")
    parser.add_argument("--start", type=Path, default=SHIPPED, help="ONNX to start from (default: the shipped one)")
    parser.add_argument("--minutes", type=float, default=4.0)
    parser.add_argument("--steps", type=int, default=100_000, help="steps at most")
    parser.add_argument("--rate", type=float, default=3e-4, help="largest step")
    parser.add_argument("--seed", type=int, default=0)


def run(given: argparse.Namespace) -> int:
    """Learn and write; 0 done, 1 refused with the reason."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    try:
        if not given.name.replace("-", "").replace("_", "").isalnum():
            raise ValueError(f"--name {given.name!r}: letters, figures, - and _ only; it becomes a file's name")
        if (given.out / f"{given.name}.onnx").exists():
            raise ValueError(f"{given.out / given.name}.onnx is there already; name another --out or --name")
        labels = read_labels(given.labels, given.photos)
        _finetune(given, labels)
    except (AsBuiltError, ValueError, OSError) as problem:
        print(f"refused: {problem}", file=sys.stderr)
        return 1
    return 0


def _finetune(given: argparse.Namespace, labels: OwnLabels) -> None:
    torch.manual_seed(given.seed)
    net = read_segmenter(given.start)
    learned, judged = split(labels.pictures)
    before = overlap(net, judged)
    new_head(net, labels)
    average = learn(net, learned, minutes=given.minutes, steps=given.steps, rate=given.rate, seed=given.seed)
    after = overlap(average, judged)
    given.out.mkdir(parents=True, exist_ok=True)
    write_segmenter(average, given.out, given.name, labels.classes)
    text = _report(labels, len(judged), kept_back=len(learned) < len(labels.pictures), before=before, after=after)
    (given.out / f"{given.name}.md").write_text(text, encoding="utf-8")
    LOG.info("%s", text)


def split(pictures: tuple[Picture, ...]) -> tuple[list[Picture], list[Picture]]:
    """Return what is learned from and what is judged by; the same photos where there are too few to keep one back."""
    if len(pictures) < KEPT_BACK:
        return list(pictures), list(pictures)
    learned = [one for k, one in enumerate(pictures) if k % KEPT_BACK != KEPT_BACK - 1]
    return learned, list(pictures[KEPT_BACK - 1 :: KEPT_BACK])


def new_head(net: Segmenter, labels: OwnLabels) -> None:
    """Give the network the labels' classes, each starting from the shipped class that is most like it."""
    old = net.logits.out
    like = [0]
    for number, name, _ in labels.classes:
        known = next((k for word, k in _LIKE if word in name.casefold()), len(CLASSES) - 1)
        like.append(min(number if number <= 2 else known, old.out_channels - 1))
    head = torch.nn.Conv2d(old.in_channels, len(like), 1)
    with torch.no_grad():
        head.weight.copy_(old.weight[like])
        head.bias.copy_(old.bias[like])
    net.logits.out = head


def learn(net: Segmenter, pictures: list[Picture], *, minutes: float, steps: int, rate: float, seed: int) -> Segmenter:
    """Learn for a few minutes; return the average of the weights."""
    rng, average = np.random.default_rng(seed), Averaged(net)
    even = torch.ones(net.logits.out.out_channels)
    optimiser = torch.optim.AdamW(net.parameters(), lr=rate, weight_decay=0.01)
    begun, spent = time.monotonic(), 0.0
    net.train()
    for step in range(steps):
        spent = max((time.monotonic() - begun) / (60.0 * minutes), step / steps)
        if spent >= 1.0:
            break
        for group in optimiser.param_groups:
            group["lr"] = rate * max(1.0 - spent, 0.02) * min(1.0, (step + 1) / 20)
        chosen = rng.integers(0, len(pictures), BATCH)
        batch = collate([training_sample(rng, pictures[k], RECIPE) for k in chosen])
        with torch.autocast("cpu", dtype=torch.bfloat16):
            logits, offsets = net(*network_inputs(batch["image"], batch["geometry"]))
        loss = class_loss(logits, batch["kind"].long(), batch["weight"].float(), even)
        loss = loss + OFFSET_WEIGHT * offset_loss(offsets, batch["offsets"].float())
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
        optimiser.step()
        average.update(net)
        if step % 25 == 0:
            LOG.info("step %d, loss %.3f", step, loss.item())
    found = average.net
    if not isinstance(found, Segmenter):  # it is a copy of one
        raise TypeError(type(found).__name__)
    return found


@torch.no_grad()
def overlap(net: Segmenter, pictures: list[Picture]) -> Overlap:
    """Return how well walls and columns are told from the rest on whole photos, without stereo."""
    net.eval()
    both, either = np.zeros(3), np.zeros(3)
    for picture in pictures:
        height, width = picture.kind.shape
        size = (WIDTH_PX, max(round(WIDTH_PX * height / width / 32) * 32, 32))
        image = torch.from_numpy(cv2.resize(picture.rgb, size, interpolation=cv2.INTER_AREA))[None]
        logits, _ = net(*network_inputs(image, torch.zeros(1, 5, size[1], size[0])))
        raised = functional.interpolate(logits.float(), size=(height, width), mode="bilinear", align_corners=False)
        answer = raised[0].argmax(0).numpy()
        for k, wanted in enumerate(((1, 2), (1,), (2,))):
            found, true = np.isin(answer, wanted), np.isin(picture.kind, wanted)
            both[k] += np.count_nonzero(found & true)
            either[k] += np.count_nonzero(found | true)
    with np.errstate(invalid="ignore"):
        concrete, wall, column = (float(v) for v in both / either)
    return Overlap(concrete=concrete, wall=wall, column=column)


def _report(labels: OwnLabels, judged: int, *, kept_back: bool, before: Overlap, after: Overlap) -> str:
    which = f"{judged} photos kept back" if kept_back else f"the same {judged} photos: too few to keep any back"
    rows = [
        f"Learned from {len(labels.names)} labelled photos; judged on {which}.\n",
        "| IoU | before | after |",
        "|---|---|---|",
    ]
    for name in ("concrete", "wall", "column"):
        rows.append(f"| {name} | {getattr(before, name):.3f} | {getattr(after, name):.3f} |")
    classes = ", ".join(f"{number} {name} ({label})" for number, name, label in labels.classes)
    return "\n".join([*rows, f"\nClasses: {classes}.", ""])
