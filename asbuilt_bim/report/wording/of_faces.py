"""Words for depth maps, masks and faces that could not be measured, and for who found a wall or column."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from asbuilt_bim.codes import Reason
from asbuilt_bim.measure.depth_source import NAME_A_NETWORK
from asbuilt_bim.report.wording.words import Table, Values, Words, fill, filled
from asbuilt_bim.vision.masks.segment import InstanceSource

_FACE = " ({label} at {distance_m:.1f} m)"
_SEEN = "seen, not measurable"
_NEARER = "photograph it from nearer, or more from the front"
_OUTLINE = "photograph it with what ends it in view, or draw it: --masks"
MOST_NAMED = 3
"""Of faces that were left out for one reason, so many are named where they are told together: the nearest."""


NOT_COUNTED_LABEL = "not counted: formwork or unclear"
UNCOUNTED: Mapping[Reason, str] = {
    Reason.STANDS_OFF: "stands off: not counted",
    Reason.OTHER_COLOUR: "other colour: not counted",
    Reason.STARTER_BARS: "starter bars? not counted",
    Reason.SURFACE_UNCLEAR: "unclear: not counted",
}
"""What a picture says on a face that counts for no element, in place of an element's name and area."""


def source_text(source: InstanceSource, segmenter: str) -> str:
    """Return who found a wall or column: `geometry`, with a network's name, or that of a network or a given mask."""
    if source is InstanceSource.BOTH:
        return f"geometry and {segmenter}"
    if source in (InstanceSource.NETWORK, InstanceSource.GIVEN):
        return segmenter or str(source)
    return str(source)


def source_of(text: str) -> tuple[InstanceSource, str]:
    """Return source and segmenter from how results called them before there was a code for it."""
    if text == "geometric":
        return InstanceSource.GEOMETRY, ""
    if text == "geometry alone":
        return InstanceSource.GEOMETRY_ALONE, ""
    first, _, segmenter = text.partition(" and ")
    if segmenter and first in ("geometry", "geometric"):
        return InstanceSource.BOTH, segmenter
    return InstanceSource.NETWORK, text


def _without_face(values: Values) -> Words:
    source = source_text(InstanceSource(str(values["source"])), str(values["segmenter"]))
    return Words(
        part=f"{values['label']} {source}",
        reason="no face was measured in this mask",
        remedy="a face is an upright plane or cylinder with texture, seen by both photos",
    )


def _uncertain(values: Values, why: str = "too uncertain", remedy: str = _NEARER) -> Words:
    known = "sigma_share" in values
    return Words(
        part=fill("face {name}" + _FACE, values),
        reason=f"{_SEEN}: {why}",
        value=f"sigma {_share(values)} of its area" if known else "sigma unknown",
        limit=fill("{limit_share:.0%}", values),
        remedy=remedy,
    )


def _share(values: Values) -> str:
    """Return a sigma as a share of its area, not rounded to its limit; past the area a figure says nothing."""
    if float(str(values["sigma_share"])) > 1.0:
        return "over 100 %"
    rounded = fill("{sigma_share:.0%}", values)
    return fill("{sigma_share:.1%}", values) if rounded == fill("{limit_share:.0%}", values) else rounded


def together(station: str, code: Reason, faces: Sequence[tuple[str, Values]]) -> Words:
    """Return what several faces of one station have in common that were seen and not measured, the nearest by name.

    `faces` are names and values; what is far off can't be measured anyway, so it is only counted.
    """
    near = sorted(faces, key=lambda one: float(str(one[1].get("distance_m", math.inf))))
    least = min(faces, key=lambda one: float(str(one[1].get("sigma_share", math.inf))))[1]
    named = [name.removeprefix(f"{station}/") + fill(_FACE, values) for name, values in near[:MOST_NAMED]]
    return replace(
        filled(FACES[code], {"name": "", **least}),
        what=f"station {station}, {len(faces)} faces",
        part=f"{len(faces)} faces, the nearest {', '.join(named)}",
        value=f"sigma {_share(least)} of the area or more" if "sigma_share" in least else "",
    )


def _of_other_colour(values: Values) -> Words:
    told = "1 upright one isn't" if values["count"] == 1 else fill("{count} upright ones aren't", values)
    return Words(
        part="surfaces of another colour",
        reason=f"{told} as grey as concrete (brick, timber?); the largest is at {fill('{x_px}, {y_px} px', values)}",
        remedy="not measured; where one is concrete, name it: --masks of measure, or a network",
    )


FACES: Table = {
    Reason.DEPTH_WITHOUT_NETWORK: Words(
        reason="depth: {depth} needs a network that gives relative depth",
        remedy=NAME_A_NETWORK.replace("{", "{{").replace("}", "}}"),
    ),
    Reason.DEPTH_WITHOUT_TARGET: Words(
        reason="depth: paper is scaled by the target (eq. 4), which isn't in view",
        remedy="place the red target, or take depth: stereo",
    ),
    Reason.DEPTH_FAILED: Words(reason="depth: {depth}: {detail}", remedy="take depth: stereo, or another network"),
    Reason.MASK_UNUSED: Words(part="masks {name}", reason="{detail}: left out"),
    Reason.INSTANCE_WITHOUT_SURFACE: Words(
        part="{label} at {x_px}, {y_px} px",
        reason="{segmenter} sees a {label} (score {score:.2f}), the depth no upright surface of its size",
        remedy=f"not measured; {_NEARER}",
    ),
    Reason.NETWORK_SAW_NOTHING: Words(
        part="network {segmenter}",
        reason="sees no wall and no column where geometry does; measured as without it",
        remedy="where the photo shows some, correct classes, input or least_score in its card, or the plugin",
    ),
    Reason.INSTANCE_WITHOUT_DEPTH: Words(
        reason="{pixels_without} of {pixels} of its boundary's pixels have no depth (depth: {depth})",
        remedy="take another depth: stereo, fused or paper",
    ),
    Reason.INSTANCE_WITHOUT_FACE: _without_face,
    Reason.SURFACE_TOO_FAR: Words(
        part="surface over {share:.0%} of the photo",
        reason="a surface at about {distance_m:.0f} m is beyond what this rig measures",
        limit="{limit_m:.0f} m",
        remedy="photograph it from nearer, or with a wider baseline",
    ),
    Reason.SURFACES_OF_OTHER_COLOUR: _of_other_colour,
    Reason.FACE_NARROW: Words(
        part="face {name}" + _FACE,
        reason=f"{_SEEN}: too narrow",
        value="{width_px:.1f} px",
        limit="{limit_px:g} px",
        remedy=_NEARER,
    ),
    Reason.FACE_UNCERTAIN: _uncertain,
    Reason.FACE_WITHOUT_END: partial(_uncertain, why="where it ends can't be seen", remedy=_OUTLINE),
}
