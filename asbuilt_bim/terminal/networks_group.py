"""`asbuilt-bim networks`: what its commands take. What they do is in `networks_command`, imported when asked for."""

from typing import Any

import click

from asbuilt_bim.terminal.guarded import guarded
from asbuilt_bim.terminal.parameters import FilePath
from asbuilt_bim.terminal.screen import Screen


@click.group(short_help="Networks of your own: add PRESET FILE.onnx.")
def networks() -> None:
    """Networks of your own: `asbuilt-bim networks add PRESET FILE.onnx` writes the card of a published one."""


@networks.command("add")
@click.argument("preset")
@click.argument("file", type=FilePath(), metavar="FILE.onnx")
@click.option("--non-commercial", is_flag=True, help="Allow a licence that forbids paid work.")
@click.option("--replace", is_flag=True, help="Replace the card if it exists.")
@click.pass_context
def add_network(context: click.Context, /, **options: Any) -> None:
    """Write the card of a published network beside FILE.onnx, after trying it.

    PRESET: depth-anything-v2-small, lite-any-stereo, rf-detr-seg-small or segformer-b0-ade20k.
    """
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.networks_command import AddRequest, add_command

        return add_command(AddRequest(**options), screen)

    guarded(context, screen, action)
