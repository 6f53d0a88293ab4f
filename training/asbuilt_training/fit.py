"""The command `fit`: learns from the shards of a folder for a given time, and keeps what it learned.

The schedule goes by the clock, so a run ends when it was meant to on a machine of any speed: small crops first, whole
pictures for the last third; the step's size rises, then falls to nothing. Pictures may still be drawn while it learns.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import logging
import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from asbuilt_training.averaged import Averaged
from asbuilt_training.classes import CLASSES, IGNORED
from asbuilt_training.curves import Row, plot, write_csv
from asbuilt_training.figures import figures
from asbuilt_training.gallery import write_gallery
from asbuilt_training.loader import Batch, Loader
from asbuilt_training.losses import (
    BOND_WEIGHT,
    DEPTH_WEIGHT,
    OFFSET_WEIGHT,
    THING_WEIGHT,
    bond_loss,
    class_loss,
    depth_loss,
    offset_loss,
    thing_loss,
)
from asbuilt_training.model import ConcreteNet, network_inputs
from asbuilt_training.samples import Recipe, Sample, plain_sample
from asbuilt_training.shards import Pool

LOG = logging.getLogger(__name__)
WARM_UP = 0.03
CROPS, WHOLE = (Recipe(width_px=256, height_px=192, least_crop=0.6), 16), (Recipe(least_crop=0.55), 8)
"""Half of the pictures, 384 wide, are made larger: the segmenter looks at photos 512 wide."""
LOOKED_AT = 60
"""Validation pictures that are looked at while it learns, with and without geometry."""
SEASONED = 300
"""Steps that weights from elsewhere count for in the average."""
PATIENCE = 8
"""Looks without anything better before it gives up."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """What a run was asked to do; written beside its weights."""

    data: str
    valid: str
    minutes: float
    look_minutes: float = 5.0
    keep_minutes: float = 10.0
    whole_from: float = 0.4  # share of the run after which pictures are learned at full size, not two thirds of it
    rate: float = 5e-4
    decay: float = 0.02
    seed: int = 0
    threads: int = 1  # two that wait for each other are slower than one wherever something else runs too


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's own arguments."""
    parser.add_argument("--data", type=Path, required=True, help="folder of shards to learn from")
    parser.add_argument("--valid", type=Path, required=True, help="folder of shards to judge by")
    parser.add_argument("--out", type=Path, required=True, help="folder of the run: weights, curves, pictures")
    parser.add_argument("--minutes", type=float, required=True, help="how long it learns")
    parser.add_argument("--look-minutes", type=float, default=5.0, help="how often it is judged")
    parser.add_argument("--rate", type=float, default=5e-4, help="largest step; batches of 16 bear no more")
    parser.add_argument("--whole-from", type=float, default=0.4, help="share of the time given to small crops first")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--start", type=Path, help="weights to start from (best.pt of another run), not random ones")
    parser.add_argument("--resume", action="store_true", help="go on where the run in --out stopped")


def run(given: argparse.Namespace) -> int:
    """Learn; 0 when the time was used up or nothing got better any more."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    plan = Plan(
        data=str(given.data), valid=str(given.valid), minutes=given.minutes, look_minutes=given.look_minutes,
        rate=given.rate, seed=given.seed, threads=given.threads, whole_from=given.whole_from,
    )  # fmt: skip
    run_ = Run(plan, given.out, resume=given.resume)
    if given.start is not None and not given.resume:
        run_.start_from(given.start)
    run_.learn()
    return 0


class Run:
    """A run: the network, its average, the optimiser, the clock and the record."""

    def __init__(self, plan: Plan, out: Path, *, resume: bool) -> None:
        torch.set_num_threads(plan.threads)
        torch.manual_seed(plan.seed)
        out.mkdir(parents=True, exist_ok=True)
        self.plan, self.out = plan, out
        self.net = ConcreteNet().to(memory_format=torch.channels_last)
        self.average = Averaged(self.net)
        self.optimiser = torch.optim.AdamW(self.net.parameters(), lr=plan.rate, weight_decay=plan.decay)
        self.step, self.spent_s, self.rows, self.best, self.stale = 0, 0.0, [], -math.inf, 0
        self.rows: list[Row]
        self.looked_at = validation(Path(plan.valid), LOOKED_AT)
        self.class_weights = class_weights(self.looked_at[0])
        if resume:
            self._resume()
        (out / "plan.json").write_text(json.dumps(dataclasses.asdict(plan), indent=1) + "\n", encoding="utf-8")

    def start_from(self, path: Path) -> None:
        """Take another run's weights instead of random ones; optimiser and clock begin anew.

        Parts that the other run's network lacked begin as a new network's do.
        """
        weights = self.net.state_dict() | torch.load(path, weights_only=True)
        self.net.load_state_dict(weights)
        self.average.net.load_state_dict(weights)
        self.average.updates = SEASONED

    def learn(self) -> None:
        """Learn until the time is up, or until nothing gets better."""
        whole = self.progress >= self.plan.whole_from
        loader = Loader(Path(self.plan.data), *(WHOLE if whole else CROPS), seed=self.plan.seed + self.step)
        parts: list[tuple[float, ...]] = []
        looked_s = kept_s = self.spent_s
        begun = time.monotonic() - self.spent_s
        try:
            for batch in loader:
                parts.append(self.one_step(batch))
                self.spent_s = time.monotonic() - begun
                if not whole and self.progress >= self.plan.whole_from:
                    whole = True
                    loader.set_recipe(*WHOLE)
                over = self.progress >= 1.0
                if over or self.spent_s - looked_s >= 60 * self.plan.look_minutes:
                    self._look(np.mean(parts, axis=0), len(parts))
                    parts, looked_s = [], self.spent_s
                if over or self.spent_s - kept_s >= 60 * self.plan.keep_minutes:
                    self.keep(self.out / "last.pt")
                    kept_s = self.spent_s
                if over or self.stale >= PATIENCE:
                    break
        finally:
            loader.close()
        self.keep(self.out / "last.pt")

    @property
    def progress(self) -> float:
        """Return the share of the run's time that is spent."""
        return min(self.spent_s / (60.0 * self.plan.minutes), 1.0)

    def one_step(self, batch: Batch) -> tuple[float, ...]:
        """Learn from one batch; return the loss of classes, offsets, depth, bonds and things' classes."""
        self.net.train()
        for group in self.optimiser.param_groups:
            group["lr"] = rate_at(self.progress, self.plan.rate)
        with torch.autocast("cpu", dtype=torch.bfloat16):
            logits, offsets, depth, bonds = self.net(*network_inputs(batch["image"], batch["geometry"]))
        kind = batch["kind"].long()
        classes = class_loss(logits, kind, batch["weight"].float(), self.class_weights)
        centres = offset_loss(offsets, batch["offsets"].float())
        # With stereo depth among its inputs, depth would be copied and nothing learned.
        alone = ~batch["has_geometry"]
        order = depth_loss(depth[alone], batch["inverse_depth"][alone]) if alone.any() else classes.detach() * 0.0
        bound, whole = bond_loss(bonds, batch["thing"]), thing_loss(logits, kind, batch["thing"])
        total = classes + OFFSET_WEIGHT * centres + DEPTH_WEIGHT * order + BOND_WEIGHT * bound + THING_WEIGHT * whole
        self.optimiser.zero_grad(set_to_none=True)
        total.backward()
        torch.nn.utils.clip_grad_norm_(self.net.parameters(), 3.0)
        self.optimiser.step()
        self.average.update(self.net)
        self.step += 1
        return classes.item(), centres.item(), order.item(), bound.item(), whole.item()

    def keep(self, path: Path) -> None:
        """Write all that is needed to go on, whole or not at all."""
        state = {
            "net": self.net.state_dict(), "average": self.average.net.state_dict(),
            "optimiser": self.optimiser.state_dict(), "step": self.step, "spent_s": self.spent_s, "rows": self.rows,
            "best": self.best, "stale": self.stale, "updates": self.average.updates,
        }  # fmt: skip
        torch.save(state, path.with_suffix(".part"))
        path.with_suffix(".part").replace(path)

    def _resume(self) -> None:
        state: dict[str, Any] = torch.load(self.out / "last.pt", weights_only=True)
        self.net.load_state_dict(state["net"])
        self.average.net.load_state_dict(state["average"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.step, self.spent_s, self.rows = state["step"], state["spent_s"], state["rows"]
        self.best, self.stale, self.average.updates = state["best"], state["stale"], state["updates"]

    def _look(self, losses: np.ndarray, steps: int) -> None:
        """Judge the average on pictures it never learned from, and put it on record."""
        with_geometry, without = self.looked_at
        seen, blind = figures(self.average.net, with_geometry), figures(self.average.net, without)
        classes, centres, order, bound, whole = (float(v) for v in losses)
        row: Row = {
            "minutes": self.spent_s / 60, "step": self.step, "steps": steps,
            "rate": rate_at(self.progress, self.plan.rate),
            "loss": float(losses @ (1.0, OFFSET_WEIGHT, DEPTH_WEIGHT, BOND_WEIGHT, THING_WEIGHT)),
            "class_loss": classes, "offset_loss": centres, "depth_loss": order, "bond_loss": bound, "thing_loss": whole,
            "wall_iou": seen.iou["wall"], "column_iou": seen.iou["column"], "concrete_iou": seen.concrete_iou,
            "wall_iou_without": blind.iou["wall"], "column_iou_without": blind.iou["column"],
            "concrete_iou_without": blind.concrete_iou, "abs_rel": blind.abs_rel, "delta": blind.delta,
        }  # fmt: skip
        self.rows.append(row)
        write_csv(self.out / "curves.csv", self.rows)
        plot(self.out / "curves.png", self.rows)
        write_gallery(self.out / "examples.png", self.average.net, with_geometry[:6], without[:6])
        LOG.info(" ".join(f"{name} {value:.4g}" for name, value in row.items()))
        score = (seen.score + blind.score) / 2
        if score > self.best:
            self.best, self.stale = score, 0
            torch.save(self.average.net.state_dict(), self.out / "best.pt")
        else:
            self.stale += 1


def rate_at(progress: float, largest: float) -> float:
    """Return the step's size: up in a moment, then down along a cosine."""
    if progress < WARM_UP:
        return largest * (0.05 + 0.95 * progress / WARM_UP)
    return largest * 0.5 * (1.0 + math.cos(math.pi * (progress - WARM_UP) / (1.0 - WARM_UP))) + 1e-6


def validation(folder: Path, count: int) -> tuple[list[Sample], list[Sample]]:
    """Return the same pictures with and without geometry, spread over the folder; always the same ones.

    Raises:
        ValueError: there are none.
    """
    pool = Pool(folder)
    if not pool.refresh():
        raise ValueError(f"{folder}: no shards of pictures to judge by (*.npz)")
    chosen = list(pool.pictures(np.random.default_rng(7)))[:count]
    rng = np.random.default_rng(11)
    return (
        [plain_sample(rng, picture, with_geometry=True) for picture in chosen],
        [plain_sample(rng, picture, with_geometry=False) for picture in chosen],
    )


def class_weights(samples: list[Sample]) -> torch.Tensor:
    """Return what a pixel of each class counts: more where the class is rare, by a mild power, within 0.6 and 2.5."""
    kinds = np.concatenate([s.kind[::4, ::4].ravel() for s in samples])
    share = np.bincount(kinds[kinds != IGNORED], minlength=len(CLASSES)) / max(len(kinds), 1)
    weights = np.clip((share.mean() / np.maximum(share, 1e-4)) ** 0.4, 0.6, 2.5)
    return torch.tensor(weights, dtype=torch.float32)
