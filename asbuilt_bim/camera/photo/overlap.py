"""Do both photos of a pair belong together? Overlap, order and rows, from features that both show."""

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.codes import Reason, Subject, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, FloatArray

LEAST_OVERLAP = 0.30
"""The paper's condition: both frames share at least 30 %."""
ROW_LIMIT_PX = 2.0
"""A calibrated rig keeps rows to a few tenths of a pixel; dense stereo fails from about two."""
_FEATURES = 1500
_WORKING_WIDTH = 800.0  # features of building sites are as many and twice as quick at this width
_RATIO = 0.85
_FEWEST = 25  # below, chance matches could make a pattern
_MODEL_TOLERANCE_PX = 3.0
_ROW_BAND_SHARE = 0.12  # of the height: a rig knocked further has no common rows
BEHIND_LIMIT = 0.2
"""Share of features with a negative disparity: chance matches stay below a few per cent."""
UPRIGHT = 0.1  # correlation of disparity with the row
_NEIGHBOURS, _NEIGHBOUR_SHARE = 6, 0.08  # of the width: nearby features differ by less, even across an edge in depth


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairMatches:
    """Features seen in both rectified photos: pixels (N, 2) left and right, after the foreign ones were taken out."""

    left_px: FloatArray
    right_px: FloatArray

    @property
    def disparity_px(self) -> FloatArray:
        """Return x left less x right (N,)."""
        disparity: FloatArray = self.left_px[:, 0] - self.right_px[:, 0]
        return disparity

    @property
    def rows_px(self) -> FloatArray:
        """Return y left less y right (N,)."""
        rows: FloatArray = self.left_px[:, 1] - self.right_px[:, 1]
        return rows


def match_pair(pair: RectifiedPair) -> PairMatches:
    """Match features of both rectified photos whose rows differ as one smooth tilt of the rig would make them."""
    scale = min(1.0, _WORKING_WIDTH / pair.camera.width_px)
    left, left_codes = _features(pair.left, pair.valid_left, scale)
    right, right_codes = _features(pair.right, pair.valid_right, scale)
    none = np.zeros((0, 2))
    if len(left) < 2 or len(right) < 2:
        return PairMatches(left_px=none, right_px=none)
    found = cv2.BFMatcher(cv2.NORM_HAMMING).knnMatch(left_codes, right_codes, k=2)
    good = [first for first, *second in found if second and first.distance < _RATIO * second[0].distance]
    a, b = left[[m.queryIdx for m in good]], right[[m.trainIdx for m in good]]
    if len(good) < 4:
        return PairMatches(left_px=none, right_px=none)
    fits = _one_tilt(a, a[:, 1] - b[:, 1], _ROW_BAND_SHARE * pair.camera.height_px)
    a, b = a[fits], b[fits]
    alike = _like_neighbours(a, a[:, 0] - b[:, 0], _NEIGHBOUR_SHARE * pair.camera.width_px)
    return PairMatches(left_px=a[alike], right_px=b[alike])


def overlap_share(pair: RectifiedPair, matches: PairMatches) -> float:
    """Return the share 0..1 of the left photo that the right one shows too, going by the nearest matches' disparity."""
    if len(matches.left_px) == 0:
        return 0.0
    height, width = pair.valid_left.shape
    y, x = np.meshgrid(np.linspace(0, height - 1, 24), np.linspace(0, width - 1, 32), indexing="ij")
    cells = np.stack([x, y], axis=-1).reshape(-1, 2)
    inside = pair.valid_left[cells[:, 1].astype(int), cells[:, 0].astype(int)]
    cells = cells[inside]
    apart = np.linalg.norm(cells[:, None] - matches.left_px[None], axis=-1)
    nearest = np.argsort(apart, axis=1)[:, : min(7, len(matches.left_px))]
    column = np.rint(cells[:, 0] - np.median(matches.disparity_px[nearest], axis=1)).astype(int)
    in_frame = (column >= 0) & (column < width)
    row = cells[:, 1].astype(int)
    seen = in_frame & pair.valid_right[row, np.clip(column, 0, width - 1)]
    return float(np.mean(seen))


def check_pair(pair: RectifiedPair, matches: PairMatches | None = None) -> tuple[Rejection, ...]:
    """Return why both photos can't be used together: swapped, not of one scene, rows apart, too little overlap.

    `matches` are those of `match_pair`, where they are there already.
    """
    subject = about(SubjectKind.STATION, pair.name)
    matches = match_pair(pair) if matches is None else matches
    count = len(matches.left_px)
    if count < _FEWEST:
        return (rejected(Reason.PHOTOS_UNRELATED, subject, found=count, needed=_FEWEST, least_overlap=LEAST_OVERLAP),)
    behind = _behind(subject, matches)
    if behind is not None:
        return (behind,)
    rejections = []
    rows = float(np.median(np.abs(matches.rows_px)))
    if rows > ROW_LIMIT_PX:
        rejections.append(rejected(Reason.PHOTOS_ROWS_APART, subject, rows_px=rows, limit_px=ROW_LIMIT_PX))
    share = overlap_share(pair, matches)
    if share < LEAST_OVERLAP:
        rejections.append(rejected(Reason.PHOTOS_OVERLAP, subject, share=share, limit_share=LEAST_OVERLAP))
    return tuple(rejections)


def _behind(subject: Subject, matches: PairMatches) -> Rejection | None:
    """Say what is wrong where the scene would lie behind the rig: photos swapped, or the right camera turned outwards.

    In a photo taken upright lower things are nearer. Swapping turns disparity's sign, so that they would be further;
    a turned camera shifts all disparities alike, and photos upside down turn both the sign and what is below.
    """
    share = float(np.mean(matches.disparity_px < -1.0))
    if share <= BEHIND_LIMIT:
        return None
    code = Reason.PHOTOS_BEHIND_RIG if nearer_below(matches) > UPRIGHT else Reason.PHOTOS_LOOK_SWAPPED
    return rejected(code, subject, share=share, limit_share=BEHIND_LIMIT)


def nearer_below(matches: PairMatches) -> float:
    """Return how disparity goes with the row downwards, as a correlation: above 0 where lower things are nearer."""
    down, disparity = matches.left_px[:, 1] - matches.left_px[:, 1].mean(), matches.disparity_px
    away = disparity - disparity.mean()
    scale = float(np.linalg.norm(down) * np.linalg.norm(away))
    return float(down @ away) / scale if scale > 0.0 else 0.0


def _features(image: ByteImage, valid: BoolArray, scale: float) -> tuple[FloatArray, ByteImage]:
    """Return feature places (N, 2) in full-size pixels and their codes (N, 32)."""
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    small = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1.0 else grey
    size = (small.shape[1], small.shape[0])
    mask = cv2.erode(cv2.resize(valid.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST), np.ones((9, 9)))
    points, codes = cv2.ORB.create(nfeatures=_FEATURES, fastThreshold=7).detectAndCompute(small, mask)
    if codes is None or len(points) == 0:
        return np.zeros((0, 2)), np.zeros((0, 32), dtype=np.uint8)
    places = np.array([point.pt for point in points], dtype=np.float64)
    return (places + 0.5) / scale - 0.5, np.asarray(codes, dtype=np.uint8)


def _one_tilt(left: FloatArray, rows: FloatArray, band: float) -> BoolArray:
    """Say which matches' row differences (N,) follow one plane over the photo, as pitch, roll and zoom make them.

    The plane is the best of samples of three from a fixed sequence, within `band` pixels.
    """
    design = np.c_[np.ones(len(left)), left / 1000.0]
    draw = np.random.default_rng(len(left)).random((200, len(left))).argsort(axis=1)[:, :3]
    level = np.stack([np.median(rows[draw], axis=1), np.zeros(200), np.zeros(200)], axis=-1)
    well = np.abs(np.linalg.det(design[draw])) > 1e-3
    tilted = np.linalg.solve(design[draw][well], rows[draw][well][..., None])[..., 0]
    planes = np.concatenate([level, tilted[np.abs(tilted[:, 1:]).max(axis=1) < 40.0]])
    misses = np.abs(rows[None, :] - planes @ design.T)
    misses[:, np.abs(rows) > band] = np.inf
    best = misses[int(np.argmin(np.minimum(misses, _MODEL_TOLERANCE_PX).sum(axis=1)))]
    fits: BoolArray = best < _MODEL_TOLERANCE_PX
    return fits


def _like_neighbours(left: FloatArray, disparity: FloatArray, tolerance: float) -> BoolArray:
    """Say which matches agree in disparity (N,) with at least half of their nearest ones: chance matches are alone."""
    if len(left) <= _NEIGHBOURS:
        return np.ones(len(left), dtype=bool)
    apart = np.linalg.norm(left[:, None] - left[None], axis=-1)
    nearest = np.argpartition(apart, _NEIGHBOURS, axis=1)[:, : _NEIGHBOURS + 1]  # itself among them
    agree = np.abs(disparity[nearest] - disparity[:, None]) < tolerance
    alike: BoolArray = agree.sum(axis=1) - 1 >= _NEIGHBOURS / 2
    return alike
