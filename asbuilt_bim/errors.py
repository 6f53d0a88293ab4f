"""What can go wrong, as a tree.

AsBuiltError                  everything this package raises on purpose; the command line prints it and exits 1
├── ProjectError              the project file: unknown keys, wrong types, paths that leave the project
├── PhotoError                a photo can't be used: missing, truncated, no picture, wrong size, another camera
├── OptionError               a command line's option can't be understood; the command line exits 2
├── MaskError                 a file of masks can't be used: no PNG, COCO or polygons, wrong size, unknown class
├── RejectedError             nothing is left to work with; its `rejections` say why
│   ├── MeasureError          a photo pair can't be measured; the message holds every reason
│   ├── CalibrationError      boards or control points don't give a rig
│   └── RigError              a rig file or a rig that can't be right
├── SurveyError               the surveyed markers can't be right: unit, duplicates, shape
├── DesignError               the IFC can't be used: not IFC, no storey, no wall or column
├── NetworkError              a network or its card can't be used: damaged, hostile, of another layout
├── ScheduleError              the schedule beside the IFC can't be used: no MS Project XML, P6 XML or CSV, damaged
├── CostError                 a table that a person filled in can't be used: costs, observations
├── WorkbookError             the last workbook can't be read, so what a surveyor wrote into it would be lost
├── ResultError               a result file is damaged or doesn't belong to this design
├── FillError                 a workbook can't be filled: of another sort, signed, ambiguous keys, formulas in the way
├── OutputError               outputs can't be written: place, rights, disk full
├── PluginError               another package's plugin is missing, doubled, or fails
└── MissingExtraError         an optional part isn't installed; the message holds the pip line

A station that can't be used is no exception: it is a `Rejection`, and the other stations count.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from asbuilt_bim.codes import Reason, Subject, Value


@dataclass(frozen=True, slots=True, kw_only=True)
class Rejection:
    """Says what was left out and why, as a code with its values; `report/wording` makes the sentence of it."""

    code: Reason
    subject: Subject
    values: Mapping[str, Value] = field(default_factory=dict, hash=False)


class AsBuiltError(Exception):
    """Base of everything this package raises on purpose; its text is a message to the user."""


class ProjectError(AsBuiltError):
    """The project file is wrong; the message lists every bad key and value."""


class PhotoError(AsBuiltError):
    """A photo can't be used."""


class OptionError(AsBuiltError):
    """The value of an option, on the command line or in Python, can't be understood."""


class MaskError(AsBuiltError):
    """A file of masks can't be used."""


class RejectedError(AsBuiltError):
    """Nothing is left to work with: `rejections` say why, and whoever stands above the wording adds their words."""

    def __init__(self, message: str, rejections: Sequence[Rejection] = ()) -> None:
        super().__init__(message)
        self.rejections = tuple(rejections)


class MeasureError(RejectedError):
    """A photo pair can't be measured; the message holds every reason."""


class CalibrationError(RejectedError):
    """Boards or control points don't give a rig."""


class RigError(RejectedError):
    """A rig file, or a rig, can't be right; what its numbers contradict is in `rejections`, too."""


class SurveyError(AsBuiltError):
    """The surveyed markers can't be right."""


class DesignError(AsBuiltError):
    """The IFC file can't be used as a design."""


class NetworkError(AsBuiltError):
    """A network, or its card, can't be used."""


class ScheduleError(AsBuiltError):
    """The schedule file beside the IFC can't be used."""


class CostError(AsBuiltError):
    """A table that a person filled in can't be used: costs, observations."""


class WorkbookError(AsBuiltError):
    """The last workbook can't be read, so what a surveyor wrote into it would be lost."""


class ResultError(AsBuiltError):
    """A result file is damaged, or doesn't belong to this design."""


class FillError(AsBuiltError):
    """A workbook of the user's can't be filled; it stays as it is."""


class OutputError(AsBuiltError):
    """Outputs can't be written."""


class PluginError(AsBuiltError):
    """Another package's plugin can't be used; the message says whose it is."""


class MissingExtraError(AsBuiltError):
    """An optional part isn't installed."""


def rejected(code: Reason, subject: Subject, /, **values: Value) -> Rejection:
    """Return a rejection, in short."""
    return Rejection(code=code, subject=subject, values=values)
