"""Plugins: what other packages add by entry points, looked up when a project names one and never before.

An entry point names a callable that takes no arguments and returns the object; what it must be able to do is in
`PluginGroup`. docs/plugins.md shows a whole package.
"""

from dataclasses import dataclass
from enum import Enum
from importlib.metadata import EntryPoint, entry_points
from textwrap import shorten

from asbuilt_bim.errors import PluginError

_LONGEST = 300  # characters of a plugin's own message

PREFIX = "plugin:"
"""What stands before a plugin's name where the project file could also name a file or a bundled network."""


class PluginGroup(Enum):
    """The entry point groups; each value holds the group's name and the method that its objects have."""

    SEGMENTERS = ("asbuilt_bim.segmenters", "segment")
    """`vision.segment.Segmenter`: finds walls and columns in a rectified pair."""
    DEPTH_NETWORKS = ("asbuilt_bim.depth_networks", "estimate")
    """`vision.depth.RelativeDepth`: estimates relative depth from one photo."""
    REPORT_WRITERS = ("asbuilt_bim.report_writers", "write")
    """`report.writers.ReportWriter`: writes a result in a format of its own."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plugin:
    """A plugin that was found and made."""

    name: str
    package: str
    version: str
    made: object  # has the group's method

    @property
    def identity(self) -> str:
        """Return what a result or a cache key names it by: another version may give other numbers."""
        return f"{self.package} {self.version}: {self.name}"

    @property
    def who(self) -> str:
        """Return whom a message names."""
        return f"the plugin '{self.name}' of {self.package} {self.version}"


def in_one_line(problem: BaseException) -> str:
    """Return what a plugin threw, in one line: some libraries' messages fill pages."""
    return f"{type(problem).__name__}: {shorten(str(problem), _LONGEST)}"


def installed(group: PluginGroup) -> tuple[str, ...]:
    """Return the names that installed packages offer in a group; nothing of theirs is imported."""
    return tuple(sorted({point.name for point in entry_points(group=group.value[0])}))


def find(group: PluginGroup, name: str) -> Plugin:
    """Load the plugin of a name (with or without `plugin:` before it) and make its object.

    Raises:
        PluginError: no package offers it, two do, or it can't be imported or made; says whose it is and what to do.
    """
    bare = name.removeprefix(PREFIX)
    point = _only(group, bare)
    package = point.dist.name if point.dist else "an unnamed package"
    version = point.dist.version if point.dist else "of unknown version"
    who = f"plugin '{bare}' ({point.value}, of {package} {version})"
    try:
        made = point.load()()
    except (Exception, SystemExit) as problem:  # others' code: whatever it throws is named as theirs
        raise PluginError(
            f"{who} can't be loaded ({in_one_line(problem)}); mend or update {package}, or take the name "
            "out of the project file"
        ) from problem
    method = group.value[1]
    if not callable(getattr(made, method, None)):
        raise PluginError(
            f"{who} gives an object of type {type(made).__name__}, which has no method {method}(), as every plugin of "
            f"{group.value[0]} has; update {package}, or take the name out of the project file"
        )
    return Plugin(name=bare, package=package, version=version, made=made)


def _only(group: PluginGroup, name: str) -> EntryPoint:
    """Return the one entry point of a name."""
    points = list(entry_points(group=group.value[0], name=name))
    different = {(point.value, point.dist.name if point.dist else ""): point for point in points}
    if not different:
        there = ", ".join(installed(group)) or "none"
        raise PluginError(
            f"no installed package offers the plugin '{name}' in {group.value[0]} (there: {there}); "
            "install its package beside asbuilt-bim, or check the name"
        )
    if len(different) > 1:
        whose = " and ".join(sorted(package or value for value, package in different))
        raise PluginError(f"the plugin '{name}' of {group.value[0]} is offered by {whose}; uninstall one of them")
    return next(iter(different.values()))
