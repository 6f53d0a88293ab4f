"""The command line: thin, friendly, and never a traceback."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import click

from asbuilt_bim.scale.executor import one_thread_each
from asbuilt_bim.terminal.guarded import FAILED, drop_unprinted, full_disk, guarded, open_closed_streams
from asbuilt_bim.terminal.networks_group import networks
from asbuilt_bim.terminal.parameters import BOARD, FAMILY_NAMES, Command, Day, FilePath, Metres, PhotoSize
from asbuilt_bim.terminal.print_group import sheets
from asbuilt_bim.terminal.screen import Screen
from asbuilt_bim.version import __version__

_FILE = FilePath()


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="asbuilt-bim")
@click.option("--debug", is_flag=True, help="Show where in the program an unexpected error arose.")
@click.pass_context
def app(context: click.Context, debug: bool) -> None:
    """Know from photographs what has been built: as-built areas and progress of concrete walls and columns.

    Exit code 0: a result was written; stations that were left out are named. 1: it failed and says why, also
    where no station of the visit could be used, or with --strict where one was left out. 2: the command line
    is wrong.
    """
    context.obj = debug


app.command_class = Command


@app.command(short_help="Measure the photos, and report what was built.")
@click.argument("project", type=_FILE, metavar="PROJECT.yaml")
@click.option(
    "--out", type=_FILE, default=Path("out"), metavar="FOLDER", help="Folder for the results; out by default."
)
@click.option("--workers", type=click.IntRange(min=1), default=None, help="Processes; one per processor by default.")
@click.option("--visit", type=Day(), default=None, help="The state as of this visit.")
@click.option("--strict", is_flag=True, help="Exit with 1 if a station was left out.")
@click.option("--refine-rig", is_flag=True, help="If the rig was knocked: use it as the visit's photos show it.")
@click.option("--allow-outside", is_flag=True, help="Allow paths that leave the project's folder.")
@click.option("--scheduler", metavar="tls://HOST:PORT", help="Measure on a Dask cluster.")
@click.option("--tls-ca", default="", metavar="FILE", help="Certificate that the cluster's own are signed with.")
@click.option("--tls-cert", default="", metavar="FILE", help="This machine's certificate, for the cluster.")
@click.option("--tls-key", default="", metavar="FILE", help="Its key.")
@click.option("--insecure-scheduler", is_flag=True, help="Allow plain tcp to a scheduler on another machine.")
@click.option("--no-cache", is_flag=True, help="Measure every station again.")
@click.option("--colour", is_flag=True, help="Paint the elements of the IFC copy by state.")
@click.option(
    "--whole-photos", is_flag=True, help="Blur nothing in pictures but people that a network or an outline finds."
)
@click.option("--quiet", is_flag=True, help="Say only what was left out and what went wrong.")
@click.option(
    "--keep-runs",
    type=click.IntRange(min=1),
    default=None,
    metavar="N",
    help="Keep only the newest N runs in FOLDER. Default: all.",
)
@click.pass_context
def run(context: click.Context, /, **options: Any) -> None:
    """Measure the stations of PROJECT.yaml and report what has been built."""
    until = options.pop("visit")
    safety = {key: options.pop(key) for key in ("tls_ca", "tls_cert", "tls_key")}
    address, insecure = options.pop("scheduler"), options.pop("insecure_scheduler")
    if address is None and (any(safety.values()) or insecure):
        raise click.UsageError("--tls-ca, --tls-cert, --tls-key and --insecure-scheduler go with --scheduler")
    screen = Screen(quiet=options["quiet"])

    def action() -> int:
        from asbuilt_bim.scale.cluster import Scheduler, check_address
        from asbuilt_bim.terminal.commands import RunRequest, run_command

        scheduler = Scheduler(address=address, insecure=insecure, **safety) if address is not None else None
        if scheduler is not None:
            check_address(scheduler)
        request = RunRequest(until=until, scheduler=scheduler, **options)
        return run_command(request, screen, datetime.now(UTC))

    guarded(context, screen, action)


@app.command(short_help="Make every output again from result.json.")
@click.argument("folder", type=_FILE)
@click.option(
    "--ifc", type=_FILE, multiple=True, help="The IFC file, if it has moved since the run. Repeat for several."
)
@click.option("--colour", is_flag=True, help="Paint the elements of the IFC copy by state.")
@click.option("--whole-photos", is_flag=True, help="Blur nothing in pictures but people whom `run` blurred.")
@click.pass_context
def report(context: click.Context, folder: Path, ifc: tuple[Path, ...], colour: bool, whole_photos: bool) -> None:
    """Make every output in FOLDER again, from its result.json and the IFC file alone."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.commands import report_command

        return report_command(folder, ifc, screen, datetime.now(UTC), colour=colour, whole_photos=whole_photos)

    guarded(context, screen, action)


@app.command(short_help="Calibrate the rig from photos of a board or tags.")
@click.argument("project", type=_FILE, metavar="[PROJECT.yaml]", required=False)
@click.option("--out", type=_FILE, required=True, metavar="RIG.yaml", help="The rig file to write.")
@click.option("--report", type=_FILE, metavar="PAGE.html", help="A page that says whether to trust the calibration.")
@click.option("--left", default="", metavar="PATTERN", help='Without a project: left photos, "cal/left_*.jpg".')
@click.option("--right", default="", metavar="PATTERN", help="The right ones.")
@click.option("--both", default="", metavar="PATTERN", help="Instead: photos that hold both eyes side by side.")
@click.option("--board", default="", metavar="BOARD", help=BOARD)
@click.option(
    "--tags",
    type=Metres(min=0.02, max=3.0),
    metavar="METRES",
    help="Instead of a board: side of the tags' black square.",
)
@click.option("--family", type=click.Choice(FAMILY_NAMES), default=FAMILY_NAMES[0], help="The tags' family.")
@click.option("--lens", type=click.Choice(["five", "rational", "fisheye"]), default="five", help="The lens to fit.")
@click.option("--format", "form", type=click.Choice(["rig", "opencv", "kalibr", "ros"]), default="rig")
@click.option("--control-points", type=_FILE, metavar="POINTS.csv", help="Measured points, instead of boards.")
@click.option("--photo-size", type=PhotoSize(), default=None, metavar="WIDTHxHEIGHT", help="Size of those photos.")
@click.option("--check-length", type=Metres(min=0.01, max=1000.0), metavar="METRES", help="A known length, in metres.")
@click.option("--check-points", default="", metavar='"XL,YL XR,YR XL,YL XR,YR"', help="Its ends in both photos.")
@click.option("--check-board", default="", metavar="BOARD", help="A second board, its squares measured.")
@click.option("--check-left", type=_FILE, metavar="PHOTO", help="The second board in the left photo.")
@click.option("--check-right", type=_FILE, metavar="PHOTO", help="The second board in the right photo.")
@click.option("--check-both", type=_FILE, metavar="PHOTO", help="Instead: one photo that holds both eyes.")
@click.option("--replace", is_flag=True, help="Replace RIG.yaml and PAGE.html if they exist.")
@click.option("--allow-outside", is_flag=True, help="Allow paths that leave the project's folder.")
@click.pass_context
def calibrate(context: click.Context, /, **options: Any) -> None:
    """Calibrate the rig from PROJECT.yaml, from photos of a --board or of --tags, or from --control-points.

    A known length (--check-length with --check-points, or a second board) refuses a rig whose scale is off.
    """
    shown = "board" if options["tags"] is None else "tags"
    pairs = ("both", shown) if options["both"] else ("left", "right", shown)
    groups = [("project",), pairs, ("control_points", "photo_size")]
    given = [group for group in groups if any(options[key] for key in group)]
    both_ways = options["both"] and (options["left"] or options["right"])
    two_kinds = bool(options["board"]) and options["tags"] is not None
    if len(given) != 1 or both_ways or two_kinds or not all(options[key] for key in given[0]):
        raise click.UsageError(
            "give PROJECT.yaml, or --left, --right (or --both) and --board or --tags, or --control-points and "
            "--photo-size"
        )
    options["photo_size"] = options["photo_size"] or (0, 0)
    if (options["check_length"] is None) != (not options["check_points"]):
        raise click.UsageError("--check-length and --check-points go together")
    keys = ("check_board", "check_both") if options["check_both"] else ("check_board", "check_left", "check_right")
    second = [bool(options[key]) for key in keys]
    if (any(second) and not all(second)) or (
        options["check_both"] and (options["check_left"] or options["check_right"])
    ):
        raise click.UsageError("--check-board, --check-left and --check-right (or --check-both) go together")
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.calibrate_command import CalibrateRequest, calibrate_command

        return calibrate_command(CalibrateRequest(**options), screen)

    guarded(context, screen, action)


@app.command()
@click.argument("file", type=_FILE, metavar="FILE.ifc")
@click.pass_context
def inspect(context: click.Context, file: Path) -> None:
    """Show what the program understands of an IFC file."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.commands import inspect_command

        return inspect_command(file, screen)

    guarded(context, screen, action)


@app.command(short_help="Take our data out of an IFC copy.")
@click.argument("file", type=_FILE, metavar="FILE.ifc")
@click.option("--out", type=_FILE, required=True, metavar="PLAIN.ifc", help="The copy to write.")
@click.option("--replace", is_flag=True, help="Replace PLAIN.ifc if it exists.")
@click.pass_context
def strip(context: click.Context, file: Path, out: Path, replace: bool) -> None:
    """Take out of an IFC copy all that asbuilt-bim wrote, and put back what it overwrote."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.commands import strip_command

        return strip_command(file, out, screen, replace_it=replace)

    guarded(context, screen, action)


@app.command(short_help="Fill quantities into a workbook of your own.")
@click.argument("workbook", type=_FILE, metavar="COST.xlsx")
@click.option("--map", "mapping", type=_FILE, required=True, metavar="MAP.yaml", help="What goes into which column.")
@click.option(
    "--result",
    type=_FILE,
    default=Path("out"),
    metavar="FOLDER",
    help="A run's folder, or a result.json; out by default.",
)
@click.option("--dry-run", is_flag=True, help="List every change, and write nothing.")
@click.pass_context
def fill(context: click.Context, workbook: Path, mapping: Path, result: Path, dry_run: bool) -> None:
    """Fill as-built quantities into a workbook of your own; every other cell stays as it is, and a backup is kept."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.fill_command import fill_command

        return fill_command(workbook, mapping, result, screen, datetime.now(UTC), dry_run=dry_run)

    guarded(context, screen, action)


@app.command(short_help="Write flat tables for ERP and Power BI.")
@click.argument("folder", type=_FILE)
@click.option("--out", type=_FILE, required=True, metavar="TABLES", help="Folder for the tables.")
@click.option("--format", "form", type=click.Choice(["csv", "parquet"]), default="csv", help="Parquet needs pyarrow.")
@click.option("--replace", is_flag=True, help="Replace tables that are there.")
@click.pass_context
def tables(context: click.Context, folder: Path, out: Path, form: str, replace: bool) -> None:
    """Write the run in FOLDER as flat tables for ERP and reporting programs: one row of each thing and visit."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.tables_command import tables_command

        return tables_command(folder, out, screen, form=form, replace_them=replace)

    guarded(context, screen, action)


@app.command(short_help="Say whether what was paid on is as it was.")
@click.argument("folder", type=_FILE, metavar="FOLDER")
@click.option("--project", type=_FILE, default=None, metavar="PROJECT.yaml", help="Look at its photos and survey, too.")
@click.option("--allow-outside", is_flag=True, help="Allow paths of PROJECT.yaml that leave its folder.")
@click.pass_context
def verify(context: click.Context, folder: Path, project: Path | None, allow_outside: bool) -> None:
    """Say whether the run in FOLDER, its signed valuations and all they rest on are as they were; exit 1 if not."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.verify_command import verify_command

        return verify_command(folder, project, screen, allow_outside=allow_outside)

    guarded(context, screen, action)


@app.command("ifcpatch-dir", short_help="Print where the ifcpatch recipe lies.")
def ifcpatch_dir() -> None:
    """Print the folder of the ifcpatch recipe AsBuiltProgress, for IFCPATCH_RECIPE_DIR."""
    click.echo(Path(__file__).resolve().parent / "ifcpatch_recipes")


@app.command(short_help="Measure one photo pair, without an IFC file.")
@click.argument("left", type=_FILE)
@click.argument("right", type=_FILE, required=False)
@click.option(
    "--rig",
    type=_FILE,
    required=True,
    multiple=True,
    metavar="RIG.yaml",
    help="Rig file of the camera pair, of this program or another. Repeat for its right camera's, and how they stand.",
)
@click.option("--rig-cameras", default="", metavar="LEFT,RIGHT", help="Which cameras, if the rig file holds more.")
@click.option("--side-by-side", is_flag=True, help="LEFT holds both eyes side by side; there is no RIGHT.")
@click.option("--out", type=_FILE, required=True, metavar="FOLDER", help="Folder for pictures, faces.csv and JSON.")
@click.option(
    "--target-diameter",
    type=Metres(0.05, 2.0),
    default=None,
    metavar="METRES",
    help="Diameter of the red disc. Without it the disc checks no scale.",
)
@click.option("--no-target", is_flag=True, help="Measure without a red disc; nothing checks the scale.")
@click.option("--refine-rig", is_flag=True, help="If the rig has moved: use it as these photos show it.")
@click.option("--masks", type=_FILE, default=None, help="PNG of labels, COCO JSON or clicked polygons of LEFT.")
@click.option("--mask-class", multiple=True, metavar="LABEL=CLASS", help="Class of a PNG's label: 1=wall, 2=column.")
@click.option("--segment-network", default="", metavar="CARD", help="Card of a segmenter, bundled, or plugin:NAME.")
@click.option("--depth-network", default="", metavar="CARD", help="Card for relative depth, bundled, or plugin:NAME.")
@click.option("--method", type=click.Choice(["default", "paper"]), default="default", help="paper: as published.")
@click.option("--depth", type=click.Choice(["stereo", "paper", "fused"]), default=None, help="The depth map to use.")
@click.option(
    "--inversion",
    type=click.Choice(["complement", "reciprocal"]),
    default=None,
    help="How --method paper inverts relative depth.",
)
@click.pass_context
def measure(context: click.Context, /, **options: Any) -> None:
    """Measure the walls and columns of one photo pair, LEFT and RIGHT, without any IFC file."""
    if options.pop("side_by_side") != (options["right"] is None):
        raise click.UsageError("name LEFT and RIGHT, or one file and --side-by-side if it holds both eyes")
    options["rig_cameras"] = tuple(name.strip() for name in options["rig_cameras"].split(",") if name.strip())
    if options["no_target"] and options["target_diameter"] is not None:
        raise click.UsageError("--no-target and --target-diameter contradict each other: give one")
    if options["mask_class"] and options["masks"] is None:
        raise click.UsageError("--mask-class says what the labels of --masks are: give both, or neither")
    if options["inversion"] is not None and options["method"] != "paper":
        raise click.UsageError("--inversion is of --method paper alone: pass that too, or drop it")
    options["inversion"] = options["inversion"] or "complement"
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.measure_command import MeasureRequest, measure_command

        return measure_command(MeasureRequest(**options), screen, datetime.now(UTC))

    guarded(context, screen, action)


@app.command(short_help="Write tables to fill in: costs, schedule, notes.")
@click.argument("project", type=_FILE, metavar="PROJECT.yaml")
@click.option(
    "--out", type=_FILE, default=None, metavar="FOLDER", help="Where to write; the project's folder if left out."
)
@click.option("--replace", is_flag=True, help="Replace tables that exist.")
@click.option("--allow-outside", is_flag=True, help="Allow paths that leave the project's folder.")
@click.pass_context
def template(context: click.Context, project: Path, out: Path | None, replace: bool, allow_outside: bool) -> None:
    """Write tables to fill in for PROJECT.yaml: costs.csv, schedule.csv, observations.csv, every element in its row."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.template_command import template_command

        return template_command(project, out, screen, replace=replace, allow_outside=allow_outside)

    guarded(context, screen, action)


@app.command(short_help="Write the photos' masks as COCO JSON.")
@click.argument("project", type=_FILE, metavar="PROJECT.yaml")
@click.option("--out", type=_FILE, required=True, metavar="LABELS.json", help="The COCO file to write.")
@click.option("--workers", type=click.IntRange(min=1), default=None, help="Processes; one per processor by default.")
@click.option("--replace", is_flag=True, help="Replace LABELS.json if it exists.")
@click.option("--allow-outside", is_flag=True, help="Allow paths that leave the project's folder.")
@click.pass_context
def label(
    context: click.Context, project: Path, out: Path, workers: int | None, replace: bool, allow_outside: bool
) -> None:
    """Write the current masks of PROJECT.yaml's photos as COCO JSON, to correct them in any annotation tool."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.label_command import label_command

        return label_command(
            project, out, workers=workers or 0, replace=replace, allow_outside=allow_outside, screen=screen
        )

    guarded(context, screen, action)


@app.command(short_help="Check today's photos before leaving the site.")
@click.argument("photos", type=_FILE, nargs=-1, required=True, metavar="PHOTOS")
@click.option("--project", type=_FILE, required=True, metavar="PROJECT.yaml", help="The project that they are for.")
@click.option(
    "--result", type=_FILE, default=None, metavar="FOLDER", help="A run's folder: what it saw built is left out."
)
@click.option(
    "--out", type=_FILE, default=Path("check.html"), metavar="PAGE.html", help="The page; check.html by default."
)
@click.option("--workers", type=click.IntRange(min=1), default=None, help="Processes; one per processor by default.")
@click.option("--strict", is_flag=True, help="Exit with 1 if a station would be left out.")
@click.option("--allow-outside", is_flag=True, help="Allow paths of PROJECT.yaml that leave its folder.")
@click.pass_context
def check(context: click.Context, /, **options: Any) -> None:
    """Check today's PHOTOS on site: a folder of pairs, or LEFT RIGHT of each station in turn.

    Says of each whether a run will count it, what to do about it, and which to take again before leaving.
    """
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.check_command import CheckRequest, check_command

        return check_command(CheckRequest(**options), screen, datetime.now(UTC).date())

    guarded(context, screen, action)


@app.command(short_help="Find the fewest stations that see what is due.")
@click.option("--project", type=_FILE, required=True, metavar="PROJECT.yaml", help="The project to visit.")
@click.option("--date", "day", type=Day(), default=None, help="The day of the visit; today if left out.")
@click.option("--stations", type=click.IntRange(min=1), default=None, metavar="N", help="So many at most.")
@click.option(
    "--result", type=_FILE, default=None, metavar="FOLDER", help="A run's folder: what it saw built is left out."
)
@click.option(
    "--out", type=_FILE, default=Path("plan.html"), metavar="PAGE.html", help="The page; plan.html by default."
)
@click.option("--allow-outside", is_flag=True, help="Allow paths of PROJECT.yaml that leave its folder.")
@click.pass_context
def plan(context: click.Context, /, **options: Any) -> None:
    """Plan a visit: the fewest stations that see what is due, drawn on plans, with a list to print."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.plan_command import PlanRequest, plan_command

        return plan_command(PlanRequest(**options), screen, datetime.now(UTC).date())

    guarded(context, screen, action)


@app.command(short_help="Draft a project file from what lies in a folder.")
@click.argument("folder", type=_FILE, default=".", metavar="[FOLDER]")
@click.pass_context
def init(context: click.Context, folder: Path) -> None:
    """Draft a project file from what lies in FOLDER, and say what is missing."""
    screen = Screen()

    def action() -> int:
        from asbuilt_bim.terminal.init_command import init_command

        return init_command(folder, screen)

    guarded(context, screen, action)


app.add_command(networks)
app.add_command(sheets)


def main() -> None:
    """Run the command line; the entry point of `asbuilt-bim`."""
    one_thread_each()
    open_closed_streams()
    try:
        app(prog_name="asbuilt-bim")
    except OSError as problem:  # of `--help` and the like, which are printed outside of `guarded`
        if not (full := full_disk(problem)):
            raise
        click.echo(f"error: {full}", err=True)
        raise SystemExit(FAILED) from problem
    finally:
        drop_unprinted()
