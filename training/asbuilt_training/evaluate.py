"""The command `evaluate`: figures of a run's network on pictures that it never learned from, with a page to look at."""

from __future__ import annotations

import argparse
import dataclasses
import json
import logging
from pathlib import Path

import torch

from asbuilt_training.figures import Figures, figures
from asbuilt_training.fit import validation
from asbuilt_training.gallery import write_gallery
from asbuilt_training.model import ConcreteNet
from asbuilt_training.shards import sources_of

LOG = logging.getLogger(__name__)
SHOWN = 24
"""Pictures of the page."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's own arguments."""
    parser.add_argument("--run", type=Path, required=True, help="folder of a run")
    parser.add_argument("--weights", default="best.pt", help="which of the run's weights")
    parser.add_argument("--valid", type=Path, required=True, help="folder of shards to judge by")
    parser.add_argument("--most", type=int, default=400, help="pictures at most")
    parser.add_argument("--data", type=Path, help="folder of shards that it learned from, to count them")


def run(given: argparse.Namespace) -> int:
    """Judge and write figures.json, report.md and pictures into the run's folder."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    torch.set_num_threads(1)
    net = ConcreteNet()
    net.load_state_dict(torch.load(given.run / given.weights, weights_only=True))
    net.eval()
    with_geometry, without = validation(given.valid, given.most)
    found = {"with geometry": figures(net, with_geometry), "without geometry": figures(net, without)}
    record: dict[str, object] = {name: dataclasses.asdict(one) for name, one in found.items()}
    if given.data is not None:
        sources = sources_of(given.data)
        record["learned_from"] = {"pictures": sum(sources.values()), "sources": sources}
    (given.run / "figures.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    for start in range(0, min(SHOWN, len(without)), 6):
        chosen = slice(start, start + 6)
        write_gallery(given.run / f"page-{start // 6}.png", net, with_geometry[chosen], without[chosen])
    text = table(found)
    (given.run / "report.md").write_text(f"# {given.run.name}\n\n{text}\n![curves](curves.png)\n", encoding="utf-8")
    LOG.info("%s", text)
    return 0


def table(found: dict[str, Figures]) -> str:
    """Return the figures as a Markdown table."""
    rows = ["| | pictures | concrete IoU | wall | column | slab | formwork | other | depth AbsRel | within 1.25 |"]
    rows.append("|---" * 10 + "|")
    for name, one in found.items():
        shares = [one.concrete_iou, *(one.iou[k] for k in ("wall", "column", "slab or beam", "formwork", "other"))]
        depth = f"{one.abs_rel:.3f} | {one.delta:.3f}" if "without" in name else "(copied) | "
        rows.append(f"| {name} | {one.pictures} | " + " | ".join(f"{v:.3f}" for v in shares) + f" | {depth} |")
    return "\n".join(rows) + "\n"
