"""`asbuilt-bim print`: what its commands take. What they do is in `print_command`, imported when asked for."""

from typing import Any

import click

from asbuilt_bim.terminal.guarded import guarded
from asbuilt_bim.terminal.parameters import BOARD, FAMILY_NAMES, FilePath, Metres
from asbuilt_bim.terminal.screen import Screen


@click.group("print", short_help="Print a board, markers or the target to scale.")
def sheets() -> None:
    """Print a calibration board, markers or the target: PDF files to scale."""


_PDF = click.option("--out", type=FilePath(), required=True, metavar="FILE.pdf", help="The PDF file to write.")
_PAPERS = click.Choice(["A4", "A3", "Letter", "Tabloid"], case_sensitive=False)
_PAPER = click.option("--paper", type=_PAPERS, default="A4", help="What doesn't fit goes in tiles.")
_REPLACE = click.option("--replace", is_flag=True, help="Replace FILE.pdf if it exists.")


@sheets.command("board")
@_PDF
@_PAPER
@click.option("--board", default="", metavar="BOARD", help=f"{BOARD} Default: the largest that fits.")
@_REPLACE
@click.pass_context
def board_sheet(context: click.Context, /, **options: Any) -> None:
    """Write a board to calibrate the rig with."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.print_command import print_board

        return print_board(screen=screen, **options)

    guarded(context, screen, action)


@sheets.command("tags")
@_PDF
@_PAPER
@click.option("--ids", default="0-3", metavar="IDS", help="Their numbers: 0-11, or 0-3,8.")
@click.option("--family", type=click.Choice(FAMILY_NAMES), default=FAMILY_NAMES[0], help="Their family.")
@click.option("--size", "size_m", type=Metres(min=0.02, max=3.0), metavar="METRES", help="Side of the black square.")
@_REPLACE
@click.pass_context
def tag_sheets(context: click.Context, /, **options: Any) -> None:
    """Write markers, one a sheet, to be surveyed."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.print_command import print_tags

        return print_tags(screen=screen, **options)

    guarded(context, screen, action)


@sheets.command("target")
@_PDF
@_PAPER
@click.option("--diameter", "diameter_m", type=Metres(min=0.05, max=2.0), metavar="METRES", help="Of the disc.")
@_REPLACE
@click.pass_context
def target_sheet(context: click.Context, /, **options: Any) -> None:
    """Write the red disc."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.print_command import print_target

        return print_target(screen=screen, **options)

    guarded(context, screen, action)
