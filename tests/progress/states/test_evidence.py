from __future__ import annotations

import numpy as np

from asbuilt_bim.bim.cells import cell_samples
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.evidence import StationView, Verdict, faced, judge, open_view
from tests.match.small_site import CAMERA, box, element, looking, station

OPTIONS = ProgressOptions()
WALL = element("W", "wall", box(0, 0, 0, 3.0, 0.25, 2.0))
BACKDROP = box(-30, 12, 0, 60, 0.5, 12)


def test_where_the_right_photo_would_not_show_a_wall_farther_ground_says_nothing_of_it() -> None:
    """Matching can't find the wall there, built or not: of all disparities only smaller ones have a partner."""
    pose = looking([3.3, -4.0, 1.2], [3.3, 0.0, 1.2])  # the wall lies in the left half of the photo
    samples, view = cell_samples(WALL, OPTIONS.spacing_m), StationView(placed=station("A1", pose, [BACKDROP]))
    seen = faced(view, samples.points_m, samples.normals, OPTIONS)
    verdict = judge(open_view(view), samples.points_m, samples.normals, seen, OPTIONS).verdict[seen.asked]
    partner_px = (seen.pixels[:, 0] - CAMERA.f_px * CAMERA.baseline_m / seen.points[:, 2])[seen.asked]
    off_the_right, on_both = partner_px < 0.0, partner_px > 0.02 * CAMERA.width_px
    assert off_the_right.sum() > 100 and on_both.sum() > 1000
    assert set(verdict[off_the_right]) == {Verdict.NOT_MEASURED}
    assert np.mean(verdict[on_both] == Verdict.BEHIND) > 0.99
