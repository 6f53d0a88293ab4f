"""The page that goes with the shipped networks: what they learned from, how, how good they are, where they fail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any

from asbuilt_training.classes import CLASSES

TEMPLATE = Path(__file__).with_name("model_card.md.in")


def model_card(
    *,
    plan: Mapping[str, Any],
    figures: Mapping[str, Any] | None,
    curves: Sequence[Mapping[str, str]],
    parameters: int,
    before: str = "",
    depth: str = "",
) -> str:
    """Return the card as Markdown, from a run's plan, its figures (None: not judged yet) and its record.

    `before` says what the weights had learned when the run took them over, where they weren't random; `depth` whence
    the depth network comes and how good it is, where it isn't this run's.
    """
    last = curves[-1]
    learned = (figures or {}).get("learned_from")
    pictures = "not counted"
    if learned:
        sources = ", ".join(f"{count} by {name}" for name, count in learned["sources"].items())
        pictures = f"{learned['pictures']} ({sources})"
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        parameters=f"{parameters / 1e6:.2f}",
        pictures=pictures,
        minutes=f"{float(last['minutes']):.0f}",
        steps=f"{float(last['step']):.0f}",
        rate=f"{plan['rate']:g}",
        decay=f"{plan['decay']:g}",
        seed=plan["seed"],
        before=f" {before.strip()}" if before else "",
        figures=_table(figures, depth) if figures else "Not judged yet.\n",
    )


def _table(figures: Mapping[str, Any], depth: str) -> str:
    rows = ["| IoU | pictures | concrete | " + " | ".join(CLASSES[1:]) + " |", "|" + "---|" * 8]
    for name in ("with geometry", "without geometry"):
        one = figures[name]
        shares = [one["concrete_iou"], *(one["iou"][k] for k in CLASSES[1:])]
        rows.append(f"| {name} | {one['pictures']} | " + " | ".join(f"{v:.3f}" for v in shares) + " |")
    blind = figures["without geometry"]
    if depth:
        return "\n".join([*rows, f"\n{depth.strip()}\n"])
    rows.append(
        f"\nDepth after scale and shift, up to 100 m: AbsRel {blind['abs_rel']:.3f}, "
        f"within a factor of 1.25 {100 * blind['delta']:.1f} %.\n"
    )
    return "\n".join(rows)
