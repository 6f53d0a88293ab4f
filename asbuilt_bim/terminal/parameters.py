"""What the command line's options take: paths, sizes in pixels, lengths within bounds."""

import errno
import math
import os
from datetime import date
from pathlib import Path
from typing import Any

import click

BOARD = "chessboard,COLUMNSxROWS,SQUARE_M or charuco,COLUMNSxROWS,SQUARE_M,MARKER_M,DICTIONARY."
FAMILY_NAMES = (
    "apriltag_36h11",
    "apriltag_36h10",
    "apriltag_25h9",
    "apriltag_16h5",
    "aruco_4x4_50",
    "aruco_5x5_100",
    "aruco_6x6_250",
    "aruco_original",
)
"""Of markers, as `vision.markers.find` has them: importing that takes a second, and `--help` shall be quick."""


class Command(click.Command):
    """A command that says what is usually wrong where more words stand on its line than it takes."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read a command's words."""
        dashed = next((word for word in args if word[:1] in ("\u2013", "\u2014")), "")
        try:
            return super().parse_args(ctx, args)
        except click.UsageError as problem:
            if type(problem) is click.UsageError:  # click's own sorts are of options and their values
                quotes = "a path with a blank in it needs quotation marks round it"
                hint = f"an option begins with two hyphens, not with {dashed[:1]}" if dashed else quotes
                raise click.UsageError(f"{problem.message}; {hint}", ctx) from problem
            raise


class FilePath(click.Path):
    """A path that a system can hold and follow; looking for another fails in a hundred places."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> Any:
        """Read a path."""
        parts = os.fsencode(value).replace(b"\\", b"/").split(b"/")
        if max(map(len, parts)) > 255 or len(os.fsencode(value)) > 4000:
            self.fail(f"{str(value)[:40]!r}... is longer than a path can be", param, context)
        try:
            Path(os.fsdecode(value)).stat()
        except OSError as problem:  # what is missing or can't be read is an error where it is used
            if problem.errno == errno.ELOOP:
                self.fail(f"{str(value)!r} is a link that leads back to itself; name the place itself", param, context)
        return super().convert(value, param, context)


class PhotoSize(click.ParamType):  # type: ignore[type-arg, unused-ignore]
    """WIDTHxHEIGHT, in pixels."""

    name = "size"

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> tuple[int, int]:
        """Read WIDTHxHEIGHT in pixels."""
        width, _, height = str(value).lower().partition("x")
        if not (width.isdecimal() and height.isdecimal() and 0 < int(width) < 100_000 and 0 < int(height) < 100_000):
            self.fail(f"{value!r} is no size in pixels, such as 1280x960", param, context)
        return int(width), int(height)


class Metres(click.FloatRange):
    """A length within bounds; click's own range names no unit, and lets nan pass, which is neither below nor above."""

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> float:
        """Read a length in metres."""
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            self.fail(f"{value!r} is no number of metres; write it with a point, such as 0.30", param, context)
        low, high = self.min or 0.0, self.max or math.inf
        if not low <= number <= high:
            self.fail(f"{number:g} m is not within {low:g} to {high:g} m; it is given in metres", param, context)
        return number


class Day(click.ParamType):  # type: ignore[type-arg, unused-ignore]
    """A day of the calendar, as YYYY-MM-DD."""

    name = "YYYY-MM-DD"

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> date:
        """Read a day."""
        try:
            return date.fromisoformat(str(value))
        except ValueError:
            self.fail(f"{value!r} is no day of the calendar; write it as 2026-03-02", param, context)
