"""Words for a station's photos, and for stations that could not be worked on."""

from collections.abc import Callable

from asbuilt_bim.codes import Reason
from asbuilt_bim.report.wording.words import Table, Values, Words, fill

MOST_NAMED = 5
_AS_STORED = "give both photos as the cameras stored them: a program turned their pixels"


def _other_station(values: Values) -> Words:
    visit = " of visit {other_visit}" if values["other_visit"] else ""
    return Words(
        reason=fill(
            f"its photos are those of station {{other}}{visit} again: what they show would count twice", values
        ),
        remedy="copy this station's own photos there, or take it out of the project file",
    )


def _saved_again(values: Values) -> Words:
    visit = " of visit {other_visit}" if values["other_visit"] else ""
    return Words(
        reason=fill(
            f"its left photo shows what that of station {{other}}{visit} shows, to the pixel: it was saved again, and "
            "what it shows would count twice",
            values,
        ),
        remedy="copy this station's own photos there, or take it out of the project file",
    )


def _station_of_other_day(values: Values) -> Words:
    if values.get("taken"):
        return Words(reason=fill("its photos are of {taken}, and not of the visit's day, {day}", values))
    said = "its photos don't say their day, and those beside it that do aren't of the visit's, {day}"
    if "taken" not in values:  # results of before
        said = "its photos, or those beside it, are of another day than {day}"
    return Words(reason=fill(said, values))


def _other_day(values: Values) -> Words:
    stations, days = values["stations"], values["days"]
    assert isinstance(stations, tuple) and isinstance(days, tuple)
    named = [f"station {name} {day}" for name, day in zip(stations, days, strict=True)]
    more = f" and {len(named) - MOST_NAMED} more" if len(named) > MOST_NAMED else ""
    if values.get("exchanged_with"):
        return Words(
            part="photos' days",
            reason=fill(
                "the photos of {name} and of {exchanged_with} are exchanged: each visit has the other's", values
            ),
            remedy="exchange the two folders, or the two dates in the project file",
        )
    remedy = "copy this visit's photos, or correct its date; if the camera's clock is wrong, write camera_clock_wrong: "
    if values.get("clock_wrong", True):  # and in results of before, where nothing was left out for it
        remedy = "they count all the same; if they are another visit's, copy this one's"
    return Words(
        part="photos' days",
        reason=f"the photos of {len(named)} of {values['count']} stations are of another day than the visit's, "
        f"{values['name']}: {', '.join(named[:MOST_NAMED])}{more}",
        remedy=remedy if values.get("clock_wrong", True) else f"{remedy}true beside the visit's date",
    )


def _swapped(reason: str, value: str, limit: str = "") -> Callable[[Values], Words]:
    """Return the words for a pair whose photos are exchanged; files that are known are named with what to do."""

    def words(values: Values) -> Words:
        remedy = "exchange left and right of the photos or of the video in the project file: no new ones are needed"
        if "left_photo" in values:
            remedy = fill(
                "give {left_photo} and {right_photo} each other's name, or exchange them in the project file: no new "
                "photos are needed",
                values,
            )
        return Words(reason=fill(reason, values), value=fill(value, values), limit=fill(limit, values), remedy=remedy)

    return words


PHOTOS: Table = {
    Reason.PHOTO_MISSING: Words(
        reason="its {side} photo is missing: there is no {photo}",
        remedy="copy it from the camera under that name, or take the station again: one eye alone measures nothing",
    ),
    Reason.PHOTO_UNUSABLE: Words(reason="{detail}"),
    Reason.PHOTOS_GREY: Words(
        reason="a photo has no colour: the red disc can't be found in it, nor concrete be told from formwork",
        remedy="give both photos in colour as the cameras stored them; turn a black-and-white mode off. Formwork at "
        "its place counts as built without colour: look for it on the pictures before you pay",
    ),
    Reason.PHOTO_TURNED: Words(
        reason="the photo is rotated against the rig",
        value="{size_px:px}",
        limit="{rig_px:px}",
        remedy="use the photo as the camera stored it: not turned, not resized, not cropped",
    ),
    Reason.PHOTO_SIZE: Words(
        reason="its size is not that of the rig's photos",
        value="{size_px:px}",
        limit="{rig_px:px}",
        remedy="use the photo as the camera stored it: not turned, not resized, not cropped",
    ),
    Reason.PHOTO_HELD_TURNED: Words(
        reason="the camera was held rotated against the photos of the boards",
        value="EXIF orientation {orientation}",
        limit="EXIF orientation {rig_orientation}",
        remedy="take the station again with the rig level, or remove a wrong EXIF orientation",
    ),
    Reason.PHOTO_OF_OTHER_SIDE: _swapped(
        "left and right are swapped: the rig's other camera took it (the {side} one's serial is {rig_serial})",
        "serial {serial}",
    ),
    Reason.PHOTOS_OF_OTHER_SIDES: _swapped(
        "left and right are swapped: each was taken by the rig's other camera",
        "serial {left_serial} left, {right_serial} right",
    ),
    Reason.PHOTO_OF_OTHER_MODEL: Words(
        reason="photo of another camera than the rig's",
        value="{model}",
        limit="{rig_model}",
        remedy="use the photos of the calibrated rig, or calibrate this one",
    ),
    Reason.PHOTO_OF_OTHER_CAMERA: Words(
        reason="photo of another camera than the rig's",
        value="serial {serial}",
        limit="serial {rig_serial}",
        remedy="use the photos of the calibrated rig, or calibrate this one",
    ),
    Reason.PHOTO_ZOOMED: Words(
        reason="zoomed or refocused against the rig",
        value="focal length {focal_mm:g} mm",
        limit="{rig_focal_mm:g} mm as on the boards",
        remedy="take the station again at the boards' zoom, or calibrate at this one",
    ),
    Reason.PHOTOS_UNUSABLE: Words(reason="{detail}"),
    Reason.PHOTOS_DIFFER_IN_SIZE: Words(
        reason="left and right photo differ in size",
        value="left {left_px:px}, right {right_px:px}",
        remedy="use both photos as the rig stored them",
    ),
    Reason.PHOTOS_OF_ONE_CAMERA: Words(
        reason="both photos were taken by the rig's {side} camera",
        value="serial {serial}",
        remedy="name the photo that the other camera took at the same moment",
    ),
    Reason.PHOTO_TWICE: Words(
        reason="left and right are the same photo",
        value="they differ by {differ_grey:.1f} grey levels",
        limit="{limit_grey:.1f}, half of what a shift of one pixel makes",
        remedy="name the photo that the other camera took at the same moment",
    ),
    Reason.PHOTOS_SWAPPED: _swapped(
        "left and right are swapped: exchanged, their rows correspond",
        "rows {rows_px:.1f} px apart, exchanged {undone_rows_px:.1f} px",
        "{limit_px:g} px",
    ),
    Reason.PHOTOS_UPSIDE_DOWN: Words(
        reason="both photos are upside down: turned by 180 degrees, their rows correspond",
        value="rows {rows_px:.1f} px apart, turned {undone_rows_px:.1f} px",
        limit="{limit_px:g} px",
        remedy=_AS_STORED,
    ),
    Reason.PHOTOS_UPSIDE_DOWN_SWAPPED: Words(
        reason="both photos are upside down, and swapped: turned by 180 degrees and exchanged, their rows correspond",
        value="rows {rows_px:.1f} px apart, turned and exchanged {undone_rows_px:.1f} px",
        limit="{limit_px:g} px",
        remedy=f"{_AS_STORED}, and exchange the left and the right one",
    ),
    Reason.PHOTOS_LOOK_SWAPPED: _swapped(
        "left and right look swapped (a part of the scene would lie behind the rig)",
        "{share:.0%} of features",
        "{limit_share:.0%}",
    ),
    Reason.PHOTOS_BEHIND_RIG: Words(
        reason="the rig was knocked: its right camera was turned outwards, or both photos are upside down (a part of "
        "the scene would lie behind the rig)",
        value="{share:.0%} of features",
        limit="{limit_share:.0%}",
        remedy="give the photos as the cameras stored them, or calibrate the rig again",
    ),
    Reason.PHOTOS_UNRELATED: Words(
        reason="left and right show too little in common: another scene, another rig, or an overlap under "
        "{least_overlap:.0%}",
        value="{found} common features",
        limit="{needed}",
        remedy="check that both photos are of this station and in focus, and that the rig is the project's",
    ),
    Reason.PHOTOS_ROWS_APART: Words(
        reason="rows of left and right don't correspond: the rig was knocked, or the photos are of another rig",
        value="rows {rows_px:.1f} px apart",
        limit="{limit_px:g} px",
        remedy="calibrate the rig again, and take the station again",
    ),
    Reason.PHOTOS_OVERLAP: Words(
        reason="the frames overlap too little",
        value="{share:.0%}",
        limit="{limit_share:.0%}",
        remedy="stand further away, or turn the cameras parallel and calibrate again",
    ),
    Reason.PHOTOS_OF_OTHER_STATION: _other_station,
    Reason.PHOTOS_SAVED_AGAIN: _saved_again,
    Reason.PHOTOS_OF_OTHER_DAY: _other_day,
    Reason.STATION_OF_OTHER_DAY: _station_of_other_day,
    Reason.PHOTO_CLIPPED: Words(
        reason="its photos are overexposed: parts are clipped white, and what stands there is not measured",
        value="{share:.0%} of the photo",
        limit="{limit_share:.0%}",
        remedy="take the station again with a shorter exposure, or with the sun behind you",
    ),
    Reason.PHOTO_DARK: Words(
        reason="its photos are too dark to show texture",
        value="{stops:+.1f} EV against mid-grey",
        limit="{limit_stops:+.1f} EV",
        remedy="take the station again by day, or expose longer from a tripod",
    ),
    Reason.PHOTO_GRAINY: Words(
        reason="its photos are grainy: the camera amplified too little light",
        value="noise of {noise_grey:.1f} grey levels",
        limit="{limit_grey:g}",
        remedy="take the station again with a lower ISO and more light, or from a tripod",
    ),
    Reason.PHOTO_COMPRESSED: Words(
        reason="its photos are stored too coarsely: the texture of concrete is rounded away",
        value="texture under {lost_grey:.1f} grey levels",
        limit="{limit_grey:g}",
        remedy="set the cameras to the best JPEG quality, and take the station again",
    ),
    Reason.PHOTO_HAZY: Words(
        reason="its photos lack contrast: haze, a misted lens, the sun shining into it, or a place that is all light",
        value="the darkest is {share:.0%} of the brightest",
        limit="{limit_share:.0%}",
        remedy="if nothing there is dark, let it be; else wipe the lenses, and take the station again in clear air, "
        "with the sun behind you",
    ),
    Reason.PHOTO_TINTED: Words(
        reason="its photos were taken in coloured light: neither the red target nor concrete shows its colour",
        value="red exceeds blue by {stops:.1f} EV",
        limit="{limit_stops:g} EV",
        remedy="set the cameras' white balance to the lamps, or take the station again by day",
    ),
    Reason.PHOTO_MOVED: Words(
        reason="the rig moved while it exposed",
        value="by about {moved_px:.0f} px, at {moved_deg:.0f}° to the level",
        limit="{limit_px:g} px",
        remedy="take the station again from a tripod, or with a shorter exposure",
    ),
    Reason.PHOTO_UNSHARP: Words(
        reason="its photos are out of focus",
        value="edges are blurred by {blur_px:.1f} px",
        limit="{limit_px:g} px",
        remedy="focus as on the photos of the boards, and take the station again",
    ),
    Reason.PHOTO_SMEARED: Words(
        reason="its photos are unsharp in parts: drops or dirt on a lens, or things that only one eye sees edge-on",
        value="{share:.0%} of them",
        limit="{limit_share:.0%}",
        remedy="look at both photos; if they are unsharp there, wipe the lenses and take the station again",
    ),
    Reason.PHOTO_VEILED: Words(
        reason="a part of its {side} photo lacks contrast: a dirty, wet or fogged lens, a finger before it, or the sun "
        "on it",
        value="{share:.0%} of it, with {contrast:.0%} of the other photo's contrast",
        limit="{limit_share:.0%}",
        remedy="wipe the {side} lens, shade it, and take the station again; look at the other stations' photos, too",
    ),
    Reason.STATION_FAILED: Words(reason="{detail}"),
    Reason.STATION_MEMORY: Words(reason="not enough memory to measure it", remedy="run with fewer --workers"),
    Reason.STATION_CRASHED: Words(
        reason="the program failed on it ({detail})",
        remedy="this is an error of asbuilt-bim's: please report it with the two photos",
    ),
    Reason.STATION_WORKER_LOST: Words(
        reason="the process that measured it died (out of memory?)", remedy="run again with fewer --workers"
    ),
    Reason.STATION_ENDLESS: Words(
        reason="measuring it did not end",
        value="more than {limit_s:.0f} s",
        remedy="look at your own networks and plugins. Where they only need long, set ASBUILT_BIM_LIMITS=4",
    ),
}
