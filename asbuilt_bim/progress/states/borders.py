"""What is left of a face's built and open pieces where all of it may lie elsewhere: lengths are doubtful."""

from dataclasses import replace

from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.progress.surface import SurfaceState


def well_inside(surface: SurfaceState) -> SurfaceState:
    """Return a state with what lies inside its borders by as much as they may lie elsewhere: what is sure to be there.

    Gaps narrower than twice that have no borders of their own.
    """
    by_m = surface.border_m
    pieces = [surface.built_uv_m, surface.open_uv_m]
    inner = [polygon.intersection(one, polygon.grown(_closed(one, by_m), -by_m)) if one else one for one in pieces]
    return replace(surface, built_uv_m=inner[0], open_uv_m=inner[1], row_log_odds=None, border_m=0.0)


def wherever_it_lies(surface: SurfaceState, *, along: bool) -> SurfaceState:
    """Return a state with what stays built, and open, wherever the borders lie; `along` the face as well as in height.

    Concrete rises from below: a border of it may lie lower, and one of what is open higher. Moved to the side a column
    is the same column.
    """
    by_m = surface.border_m
    sides = (-by_m, by_m) if along else ()
    built, opened = (
        _in_all(one, [(0.0, up_m), *((side_m, 0.0) for side_m in sides)], by_m)
        for one, up_m in ((surface.built_uv_m, -by_m), (surface.open_uv_m, by_m))
    )
    return replace(surface, built_uv_m=built, open_uv_m=opened, row_log_odds=None, border_m=0.0)


def _in_all(region: Region, moves_m: list[tuple[float, float]], gap_m: float) -> Region:
    """Return what of a region lies in each of its moved copies."""
    if not region or not gap_m:
        return region
    closed = _closed(region, gap_m)
    for move_m in moves_m:
        moved = tuple(tuple(ring + move_m for ring in rings) for rings in closed)
        region = polygon.intersection(region, moved)
    return region


def _closed(region: Region, gap_m: float) -> Region:
    return polygon.grown(polygon.grown(region, gap_m), -gap_m)
