"""Elements that nobody has seen, written short: most of a large design, at each visit.

Of their faces stands what plans, revisions and new GlobalIds ask for, by element: a file grows with what was seen.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from itertools import groupby, pairwise
from typing import Any

import cv2
import numpy as np

from asbuilt_bim.progress.report import ElementProgress
from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.report.result.arrays_json import METRE_DECIMALS
from asbuilt_bim.report.result.notes_json import CODES

KEY = "unseen"
FORMER_KEY = "unseen_faces"
"""Where versions 1.7 to 1.10 have the faces, each with its whole id and element."""
STRAIGHT_M = 1e-5
"""A ring's points this near to the line of their neighbours are left out: a round column's come every 9 mm."""
_UPRIGHT = [0.0, 0.0, 1.0]
_BOX = 4
Plain = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Nothing:
    """What is known of an element that nobody has seen: a face's plain state, and the element's optional keys."""

    state: Plain
    element: Plain


def nothing_known(plain_of: Callable[[Any], Any]) -> Nothing:
    """Return the plain state of a face of which nothing is known, without what is its own, and such an element's keys.

    An element's keys are those that a reader sets by itself where they are left out.
    """
    state = SurfaceState(
        face_id="", element="", built_uv_m=(), open_uv_m=(), unknown_uv_m=(), outline_uv_m=(), built_area_m2=0.0,
        open_area_m2=0.0, unknown_area_m2=0.0, as_built_area_m2=None, as_built_sigma_calibration_m2=0.0,
        as_built_sigma_image_m2=0.0, offset_m=None, offset_sigma_m=None, tilt_rad=None, stations={},
        conflict_area_m2=0.0, notes=(),
    )  # fmt: skip
    optional = {field.name: field.default for field in fields(ElementProgress) if field.default is not MISSING}
    element = {name: [] if value == () else plain_of(value) for name, value in optional.items()}
    return Nothing(state=plain_of(state), element=element | {CODES[name]: [] for name in CODES if name in element})


def with_unseen_apart(document: Plain, nothing: Nothing) -> Plain:
    """Return a plain report with the faces of unseen elements apart: without a state, which all of them share.

    They are kept where they can be told from the rest by their element alone, and put back in its order.
    """
    places = {element["global_id"]: number for number, element in enumerate(document["elements"])}
    faces = document["faces"]
    order = [places.get(face["element"], -1) for face in faces]
    if -1 in order or any(one > other for one, other in pairwise(order)):
        return document
    seen: list[Plain] = []
    unseen: dict[str, Plain] = {}
    for key, group in groupby(faces, lambda face: face["element"]):
        own = list(group)
        if all(_is_unseen(face, nothing) for face in own):
            unseen[key] = {"element": key, "faces": list(map(_short, own))}
        else:
            seen += own
    elements = [
        _without(element, nothing.element) if element["global_id"] in unseen else element
        for element in document["elements"]
    ]
    unobserved = [face_id for face_id in document["unobserved"] if _element_of(face_id) not in unseen]
    return {**document, "elements": elements, "unobserved": unobserved, "faces": seen, KEY: list(unseen.values())}


def with_unseen_among(document: Mapping[str, Any], nothing: Nothing) -> Plain:
    """Return a plain report with the faces of unseen elements among the others again, in the order of the elements."""
    values = {key: value for key, value in document.items() if key not in (KEY, FORMER_KEY)}
    restored = [_restored(one["element"], face, nothing) for one in document.get(KEY, ()) for face in one["faces"]]
    restored += [_as_it_was(face, nothing) for face in document.get(FORMER_KEY, ())]
    if not restored:
        return values
    places = {element["global_id"]: number for number, element in enumerate(document["elements"])}
    named = set(document["unobserved"])
    unobserved = [*document["unobserved"], *(face["face_id"] for face in restored if face["face_id"] not in named)]
    return {
        **values,
        "faces": sorted((*document["faces"], *restored), key=lambda face: places.get(face["element"], len(places))),
        "unobserved": sorted(unobserved, key=lambda face_id: places.get(_element_of(face_id), len(places))),
    }


def _is_unseen(face: Plain, nothing: Nothing) -> bool:
    """Say whether nothing is known of a face, and its id is its element's: what of it is unknown is what is exposed."""
    state = {**face["surface"], "unknown_uv_m": face["exposed_uv_m"]}  # its outline may begin at another corner
    return bool(state == _state(face, nothing)) and _element_of(face["face_id"]) == face["element"]


def _element_of(face_id: str) -> str:
    return face_id.rpartition("-")[0]


def _without(element: Plain, optional: Plain) -> Plain:
    """Return an element without the keys that a reader sets by itself."""
    return {key: value for key, value in element.items() if key not in optional or value != optional[key]}


def _short(face: Plain) -> Plain:
    """Return a face without its state and without what follows from the rest; its rings have their corners alone."""
    frame = [[_rounded(value) for value in row] for row in face["frame_m"]]
    flat = face["kind"] == "plane"
    short = {
        "id": face["face_id"].rpartition("-")[2],
        "role": face["role"],
        "frame_m": frame[:2] if flat and frame[2] == _UPRIGHT else frame,
        "area_m2": _rounded(face["area_m2"]),
        "exposed_uv_m": [[_corners(ring) for ring in rings] for rings in face["exposed_uv_m"]],
    }
    if not flat:
        short["radius_m"] = _rounded(face["radius_m"])
    if face["exposed_area_m2"] != face["area_m2"]:
        short["exposed_area_m2"] = _rounded(face["exposed_area_m2"])
    return short


def _restored(element: str, short: Plain, nothing: Nothing) -> Plain:
    frame, flat = short["frame_m"], "radius_m" not in short
    face = {
        "face_id": f"{element}-{short['id']}",
        "element": element,
        "kind": "plane" if flat else "cylinder",
        "role": short["role"],
        "frame_m": [*frame, _UPRIGHT] if flat and len(frame) == 2 else frame,
        "radius_m": short.get("radius_m", 0.0),
        "area_m2": short["area_m2"],
        "exposed_area_m2": short.get("exposed_area_m2", short["area_m2"]),
        "exposed_uv_m": short["exposed_uv_m"],
    }
    return {**face, "surface": _state(face, nothing)}


def _as_it_was(former: Plain, nothing: Nothing) -> Plain:
    """Return a face as versions 1.7 to 1.10 write it, with its state."""
    face = {key: value for key, value in former.items() if key != "unknown_uv_m"}
    state = _state(face, nothing)
    return {**face, "surface": {**state, "unknown_uv_m": former.get("unknown_uv_m", state["unknown_uv_m"])}}


def _state(face: Plain, nothing: Nothing) -> Plain:
    return {
        **nothing.state,
        "face_id": face["face_id"],
        "element": face["element"],
        "unknown_uv_m": face["exposed_uv_m"],
        "unknown_area_m2": face["exposed_area_m2"],
    }


def _corners(ring: Sequence[Sequence[float]]) -> Sequence[Sequence[float]]:
    """Return a ring without the points on its straight sides."""
    if len(ring) <= _BOX:
        return ring
    points = np.asarray(ring, dtype=np.float32)
    kept = set(map(tuple, cv2.approxPolyDP(points, STRAIGHT_M, closed=True)[:, 0].tolist()))
    corners = [one for one, point in zip(ring, points.tolist(), strict=True) if tuple(point) in kept]
    return corners if len(kept) > 2 else ring


def _rounded(value: float) -> float:
    return round(value, METRE_DECIMALS) + 0.0  # + 0.0 turns -0.0 into 0.0
