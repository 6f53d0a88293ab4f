"""Facets as one triangle after the other would gather them, whichever are asked at once."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.bim.mesh import Mesh
from asbuilt_bim.ifc.geometry import coplanar_regions as module
from asbuilt_bim.ifc.geometry.coplanar_regions import COPLANAR_M, COPLANAR_RAD, LATERAL, coplanar_regions


def _one_by_one(mesh: Mesh) -> list[list[int]]:
    """Return the facets as the definition has them: the largest triangle left takes what lies in its plane."""
    corners = mesh.corners_m
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double = np.linalg.norm(across, axis=1)
    normals = across / double[:, None]
    left = np.abs(normals[:, 2]) < LATERAL
    facets = []
    for seed in np.argsort(-double, kind="stable"):
        if left[seed]:
            near = left & (np.abs((corners - corners[seed, 0]) @ normals[seed]).max(axis=1) < COPLANAR_M)
            near &= normals @ normals[seed] > np.cos(COPLANAR_RAD)
            left &= ~near
            facets.append(np.flatnonzero(near).tolist())
    return facets


def _bend(turn_deg: float, strips: int) -> Mesh:
    """Return a wall of strips 0.1 m wide, each turned a little more than the one before."""
    angles = np.radians(turn_deg) * np.arange(strips)
    steps = 0.1 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    foot = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    low, high = (np.column_stack([foot, np.full(len(foot), z)]) for z in (0.0, 3.0))
    n = np.arange(strips)
    up = len(foot)
    triangles = np.concatenate([np.stack([n, n + 1, n + 1 + up], 1), np.stack([n, n + 1 + up, n + up], 1)])
    return Mesh(vertices_m=np.concatenate([low, high]), triangles=triangles.astype(np.int32))


@pytest.mark.parametrize("at_once", [1, 100, 1_000_000])
@pytest.mark.parametrize("turn_deg", [0.0, 0.2, 0.45, 0.9, 6.0])
def test_facets_are_what_one_triangle_after_the_other_gathers(
    turn_deg: float, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_PAIRS_AT_ONCE", at_once)
    mesh = _bend(turn_deg, 40)
    assert [part.triangles.tolist() for part in coplanar_regions(mesh)] == _one_by_one(mesh)


def test_a_round_columns_facets_are_found_in_one_go(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    before = module._coplanar

    def counted(corners, normals, sliver, seeds):  # type: ignore[no-untyped-def]
        asked.append(len(seeds))
        return before(corners, normals, sliver, seeds)

    monkeypatch.setattr(module, "_coplanar", counted)
    assert len(coplanar_regions(_bend(6.0, 60))) == 60
    assert asked == [120]
