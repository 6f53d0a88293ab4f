"""Writes the truth of a site's visits as one JSON document (format asbuilt-synthetic/truth, version 1)."""

from __future__ import annotations

from typing import Any

import numpy as np

from asbuilt_synthetic.layout import design
from asbuilt_synthetic.model import CameraTruth, RigTruth, Scene, Station
from asbuilt_synthetic.surface import cells
from asbuilt_synthetic.truth import StationTruth, element_samples, exposed_area_m2, station_truth

COMPLETE_FROM = 0.98


def truth_document(seed: int, scenes: list[Scene]) -> dict[str, Any]:
    """Collect the truth of all visits; lengths in metres, pixels in the distorted photos."""
    first = scenes[0]
    exposed = exposed_area_m2(first)
    return {
        "format": "asbuilt-synthetic/truth",
        "version": 1,
        "seed": seed,
        "rig": _rig(first.rig),
        "world_from_site": _plain(design(seed).world_from_local),
        "faces": [
            {
                "element": f.element,
                "name": f.name,
                "kind": f.kind,
                "origin_m": _plain(f.origin_m, 5),
                "normal": _plain(f.normal, 8),
                "radius_m": f.radius_m,
                "design_area_m2": _number(f.design_area_m2),
                "exposed_area_m2": _number(exposed[i]),
            }
            for i, f in enumerate(first.faces)
        ],
        "visits": [_visit(s) for s in scenes],
    }


def state_of(completion: float) -> str:
    """Name the state: complete from 98 %, part, not started."""
    return "complete" if completion >= COMPLETE_FROM else "part" if completion > 0 else "not started"


def _visit(scene: Scene) -> dict[str, Any]:
    truths = [station_truth(scene, s) for s in scene.stations]
    elements = [_element(scene, i, truths) for i in range(len(scene.elements))]
    areas = [(s.area_m2[s.built & s.exposed].sum(), s.area_m2[s.exposed].sum()) for s in element_samples(scene)]
    return {
        "date": scene.day.isoformat(),
        "storeys": [_storey(scene, name, elements, np.array(areas)) for name in scene.storeys],
        "elements": elements,
        "stations": [_station(s, t) for s, t in zip(scene.stations, truths, strict=True)],
    }


def _element(scene: Scene, index: int, truths: list[StationTruth]) -> dict[str, Any]:
    e = scene.elements[index]
    design_element = design(scene.seed).vertical[index]
    size = cells(design_element)
    area = np.prod(size[:, :, 1] - size[:, :, 0], axis=1)
    below = np.clip((e.built_height_fraction - size[:, 1, 0]) / (size[:, 1, 1] - size[:, 1, 0]), 0, 1)
    completion = float((area * below).sum() / area.sum())
    visible = np.any([t.cell_visible[index] for t in truths], axis=0)
    near = np.any([t.cell_visible_near[index] for t in truths], axis=0)
    half = np.any([t.cell_half_visible[index] for t in truths], axis=0)
    return {
        "global_id": e.global_id,
        "class": e.ifc_class,
        "name": e.name,
        "storey": e.storey,
        "state": state_of(completion),
        "height_fraction": e.built_height_fraction,
        "completion": _number(completion),
        "completion_by_cells": _number(float(area[e.cell_built].sum() / area.sum())),
        "cells": len(area),
        "visible_share": _number(float(visible.mean())),
        "visible_share_within_10_m": _number(float(near.mean())),
        "half_visible_share": _number(float(half.mean())),
        "cell_built": _bits(e.cell_built),
        "cell_visible": _bits(visible),
        "cell_visible_within_10_m": _bits(near),
        "cell_half_visible": _bits(half),
    }


def _storey(scene: Scene, name: str, elements: list[dict[str, Any]], areas: np.ndarray) -> dict[str, Any]:
    of_storey = np.array([e.storey == name for e in scene.elements])
    built, total = areas[of_storey].sum(0)
    return {
        "name": name,
        "completion_by_area": _number(float(built / total)),
        "completion_by_element": _number(float(np.mean([e["completion"] for e in elements if e["storey"] == name]))),
        "built_area_m2": _number(float(built)),
        "exposed_area_m2": _number(float(total)),
    }


def _station(station: Station, t: StationTruth) -> dict[str, Any]:
    disc = None
    if t.disc is not None:
        disc = {
            "left_px": _plain(t.disc.left_px, 3),
            "right_px": _plain(t.disc.right_px, 3),
            "depth_m": _number(t.disc.depth_m, 5),
            "range_m": _number(t.disc.range_m, 5),
        }
    return {
        "name": station.name,
        "world_from_left": _plain(station.world_from_left),
        "disc": disc,
        "markers": list(t.marker_ids),
        "faces": [
            {
                "face": f.face,
                "built_area_m2": _number(f.built_area_m2),
                "visible_area_m2": _number(f.visible_area_m2),
                "wholly_in_view": f.wholly_in_view,
                "narrow_px": _number(f.narrow_px, 1),
                "distance_m": _number(f.distance_m, 3),
                "incidence_deg": _number(f.incidence_deg, 1),
            }
            for f in t.faces
        ],
    }


def _rig(rig: RigTruth) -> dict[str, Any]:
    centre = -rig.right_from_left[:3, :3].T @ rig.right_from_left[:3, 3]
    return {
        "left": _camera(rig.left),
        "right": _camera(rig.right),
        "right_from_left": _plain(rig.right_from_left),
        "baseline_m": _number(float(np.linalg.norm(centre)), 6),
    }


def _camera(c: CameraTruth) -> dict[str, Any]:
    return {"K": _plain(c.K), "distortion": _plain(c.distortion), "width_px": c.width_px, "height_px": c.height_px}


def _plain(a: np.ndarray, digits: int = 9) -> Any:
    return np.round(np.asarray(a, np.float64), digits).tolist()


def _number(v: float, digits: int = 4) -> float:
    return round(float(v), digits)


def _bits(flags: np.ndarray) -> str:
    return "".join("1" if f else "0" for f in flags)
