"""Faces of elements that nobody has seen, written once and short: most faces of a large design, at each visit."""

from collections.abc import Callable, Mapping
from itertools import groupby, pairwise
from typing import Any

from asbuilt_bim.progress.surface import SurfaceState

KEY = "unseen_faces"
Plain = dict[str, Any]


def nothing_known(plain_of: Callable[[SurfaceState], Plain]) -> Plain:
    """Return the plain state of a face of which nothing is known, without what is its own."""
    nothing = SurfaceState(
        face_id="", element="", built_uv_m=(), open_uv_m=(), unknown_uv_m=(), outline_uv_m=(), built_area_m2=0.0,
        open_area_m2=0.0, unknown_area_m2=0.0, as_built_area_m2=None, as_built_sigma_calibration_m2=0.0,
        as_built_sigma_image_m2=0.0, offset_m=None, offset_sigma_m=None, tilt_rad=None, stations={},
        conflict_area_m2=0.0, notes=(),
    )  # fmt: skip
    return plain_of(nothing)


def with_unseen_apart(document: Plain, nothing: Plain) -> Plain:
    """Return a plain report with the faces of unseen elements apart: without a state, which all of them share.

    They are kept where they can be told from the rest by their element alone, and put back in its order.
    """
    places = {element["global_id"]: number for number, element in enumerate(document["elements"])}
    faces = document["faces"]
    order = [places.get(face["element"], -1) for face in faces]
    if -1 in order or any(one > other for one, other in pairwise(order)):
        return document
    seen: list[Plain] = []
    short: list[Plain] = []
    for _, group in groupby(faces, lambda face: face["element"]):
        own = list(group)
        if all(face["surface"] == _state(_short(face), nothing) for face in own):
            short += map(_short, own)
        else:
            seen += own
    return {**document, "faces": seen, KEY: short}


def with_unseen_among(document: Mapping[str, Any], nothing: Plain) -> Plain:
    """Return a plain report with the faces of unseen elements among the others again, in the order of the elements."""
    values = {key: value for key, value in document.items() if key != KEY}
    short = document.get(KEY, ())
    if not short:
        return values
    places = {element["global_id"]: number for number, element in enumerate(document["elements"])}
    restored = [
        {**{key: value for key, value in face.items() if key != "unknown_uv_m"}, "surface": _state(face, nothing)}
        for face in short
    ]
    faces = [*document["faces"], *restored]
    return {**values, "faces": sorted(faces, key=lambda face: places.get(face["element"], len(places)))}


def _short(face: Plain) -> Plain:
    """Return a face without its state; what of it is unknown is what is exposed, and stands there where it isn't."""
    unknown = face["surface"]["unknown_uv_m"]
    own = {} if unknown == face["exposed_uv_m"] else {"unknown_uv_m": unknown}
    return {key: value for key, value in face.items() if key != "surface"} | own


def _state(short: Plain, nothing: Plain) -> Plain:
    return {
        **nothing,
        "face_id": short["face_id"],
        "element": short["element"],
        "unknown_uv_m": short.get("unknown_uv_m", short["exposed_uv_m"]),
        "unknown_area_m2": short["exposed_area_m2"],
    }
