"""Rows of a face that are as clear as one likes, for tests that say by hand what is built and open."""

from asbuilt_bim.bim.cells import cell_samples
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.likelihood import MOST_NATS
from asbuilt_bim.progress.states.rows import row_log_odds, sides_of

SPACING_M = ProgressOptions().spacing_m


def clearly(of: object, index: int, built: Region, opened: Region, nats: float = MOST_NATS) -> FloatArray | None:
    """Return a face's rows as they are where its samples are so clear."""
    samples = cell_samples(of, SPACING_M)  # type: ignore[arg-type]
    is_built, is_open = (polygon.contains(region, samples.uv_m) for region in (built, opened))
    sides = [side for side in sides_of(of, SPACING_M) if side.face == index]  # type: ignore[arg-type]
    return row_log_odds(sides, nats * (is_built * 1.0 - is_open))
