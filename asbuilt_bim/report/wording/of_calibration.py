"""Words for board pairs, tags and control points that a calibration left out."""

from asbuilt_bim.codes import Reason
from asbuilt_bim.report.wording.words import Table, Values, Words, fill

_AGAIN = "take it again with rig and board at rest, sharp and evenly lit"


def _no_board(values: Values) -> Words:
    kind = "inner corners" if values["board"] == "chessboard" else "ChArUco squares of {dictionary}"
    return Words(
        reason="the board was not found in both photos",
        remedy=fill(
            f"check that the board has {{columns}} x {{rows}} {kind}, and that both photos show it sharply", values
        ),
    )


def _other_camera(values: Values) -> Words:
    return Words(
        reason="its EXIF differs from the other pairs': another camera, another zoom, or left and right exchanged",
        value=_cameras(values, ""),
        limit=_cameras(values, "usual_"),
        remedy="take all boards with the rig as it is used, its zoom fixed",
    )


def _cameras(values: Values, owner: str) -> str:
    models, serials, focals, turns = (
        values[f"{owner}{name}"] for name in ("models", "serials", "focals_mm", "orientations")
    )
    assert isinstance(models, tuple) and isinstance(serials, tuple)
    assert isinstance(focals, tuple) and isinstance(turns, tuple)
    each = zip(models, serials, focals, turns, strict=True)
    return "; ".join(
        f"{model or 'no model'} {serial} {focal:g} mm, orientation {turn}" for model, serial, focal, turn in each
    )


CALIBRATION: Table = {
    Reason.BOARD_NOT_FOUND: _no_board,
    Reason.BOARD_PAIR_TWICE: Words(
        reason="these are the photos of {other} again, which prove nothing twice",
        remedy="take another pair, the board elsewhere and tilted otherwise",
    ),
    Reason.BOARD_PAIR_OF_ONE_PHOTO: Words(
        reason="left and right are the same photo",
        remedy="name the photo that the other camera took at the same moment",
    ),
    Reason.BOARD_PAIR_OF_OTHER_CAMERA: _other_camera,
    Reason.BOARD_PAIR_MISFIT: Words(
        reason="its corners don't fit the other pairs",
        value="{rms_px:.2f} px",
        limit="{limit_px:.2f} px",
        remedy=_AGAIN,
    ),
    Reason.BOARD_PAIR_MOVED: Words(
        reason="left and right were not taken at one moment: the rig moved between them", remedy=_AGAIN
    ),
    Reason.BOARD_PAIR_MIXED: Words(
        reason="left and right were not taken at one moment: by the board {left} goes with {right}",
        remedy="name the photos of one moment alike",
    ),
    Reason.BOARD_PAIR_EXCHANGED: Words(reason="left and right are exchanged", remedy="exchange the two photos"),
    Reason.CONTROL_POINT_MISFIT: Words(
        reason="it doesn't fit the others",
        value="{miss_px:.1f} px",
        limit="{limit_px:.1f} px",
        remedy="check its coordinates and its marks in both photos",
    ),
    Reason.TAG_MISFIT: Words(
        reason="its corners don't fit the other tags: another size, moved between the two photos, bent, or half hidden",
        value="{rms_px:.2f} px",
        limit="{limit_px:.2f} px",
        remedy="use flat tags of one size, and photos of one moment",
    ),
    Reason.TAGS_NOT_FOUND: Words(
        reason="no tag of {family} was found in both photos",
        remedy="check the family, and that both photos show tags sharply",
    ),
}
