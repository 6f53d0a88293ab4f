"""What a station's faces know of each other: edges' own disparities, and which faces meet where."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from asbuilt_bim.measure.outline.edges import pixel_plane
from asbuilt_bim.measure.planes.adjust import Adjusted, EdgeSight, Touch, adjust_planes
from asbuilt_bim.measure.planes.face_hypotheses import Draft
from asbuilt_bim.measure.workbench import Workbench


def adjust_drafts(bench: Workbench, drafts: Sequence[Draft]) -> Adjusted:
    """Solve the drafts' planes together."""
    scene = bench.scene
    vertical = scene.vertical
    sigma = vertical.sigma_rad if vertical is not None else np.radians(10.0)
    return adjust_planes(
        [draft.sight for draft in drafts],
        _edge_sights(bench, drafts),
        _touches(bench, drafts),
        scene.level.view.down,
        max(sigma, 1e-3),
        [True] * len(drafts),
    )


def _edge_sights(bench: Workbench, drafts: Sequence[Draft]) -> list[EdgeSight]:
    """Return the disparities that upright edges show by themselves, at both ends' thirds."""
    camera = bench.pair.camera
    sights: list[EdgeSight] = []
    for i, draft in enumerate(drafts):
        for edge in draft.outline.edges if draft.outline is not None else ():
            fit = edge.fit
            if fit is None or edge.course != "upright" or not np.isfinite(fit.disparity_miss_px):
                continue
            if fit.strength < 0.5 or abs(fit.disparity_miss_px) > 2.0 or fit.line.length_px < 40.0:
                continue
            middle = 0.5 * (fit.line.start + fit.line.stop)
            ray = np.array([(middle[0] - camera.cx_px) / camera.f_px, (middle[1] - camera.cy_px) / camera.f_px, 1.0])
            disparity = float(ray @ draft.sight.q_px) + fit.disparity_miss_px
            sights.append(EdgeSight(plane=i, ray=ray, disparity_px=disparity, sigma_px=fit.miss_sigma_px))
    return sights


def _touches(bench: Workbench, drafts: Sequence[Draft]) -> list[Touch]:
    """Return which drafts of one instance meet in a visible edge."""
    camera = bench.pair.camera
    place = {draft.piece: i for i, draft in enumerate(drafts)}
    touches: list[Touch] = []
    for i, draft in enumerate(drafts):
        piece = bench.scene.pieces[draft.piece]
        j = place.get(draft.piece + 1)
        if j is None or not piece.convex_next or drafts[j].instance != draft.instance or draft.outline is None:
            continue
        shared = [e for e in draft.outline.edges if e.neighbour == drafts[j].piece and e.course == "upright"]
        if not shared:
            continue
        edge = max(shared, key=lambda e: e.line.length_px)
        ends = np.stack([edge.line.start, edge.line.stop])
        rays = np.ones((2, 3))
        rays[:, :2] = (ends - [camera.cx_px, camera.cy_px]) / camera.f_px
        slope = pixel_plane(draft.sight.q_px - drafts[j].sight.q_px, camera)[:2]
        off_px = edge.sigma_px * float(np.hypot(slope[0], slope[1]))
        touches.append(Touch(one=i, other=j, rays=rays, off_px=off_px))
    return touches
