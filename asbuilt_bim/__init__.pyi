"""What `import asbuilt_bim` offers, typed; `__init__.py` imports each name when it is first asked for."""

from asbuilt_bim.api import Run as Run
from asbuilt_bim.api import remake as remake
from asbuilt_bim.api import run as run
from asbuilt_bim.api import write_asbuilt as write_asbuilt
from asbuilt_bim.bim.model import BimElement as BimElement
from asbuilt_bim.bim.model import BimModel as BimModel
from asbuilt_bim.camera.rig import StereoRig as StereoRig
from asbuilt_bim.camera.rig_formats.opencv import Foreign as Foreign
from asbuilt_bim.camera.rig_formats.reader import read_rig as read_rig
from asbuilt_bim.codes import Note as Note
from asbuilt_bim.errors import AsBuiltError as AsBuiltError
from asbuilt_bim.errors import Rejection as Rejection
from asbuilt_bim.flow.measure_pair import measure_pair as measure_pair
from asbuilt_bim.flow.output.measurement import save_measurement as save_measurement
from asbuilt_bim.ifc.apart import read_design as read_design
from asbuilt_bim.ifc.apart import strip_asbuilt as strip_asbuilt
from asbuilt_bim.measure.faces import MeasuredFace as MeasuredFace
from asbuilt_bim.measure.options import MeasureOptions as MeasureOptions
from asbuilt_bim.measure.pair import PairMeasurement as PairMeasurement
from asbuilt_bim.progress.report import ElementProgress as ElementProgress
from asbuilt_bim.progress.report import ProgressReport as ProgressReport
from asbuilt_bim.project.model import Project as Project
from asbuilt_bim.project.read import read_project as read_project
from asbuilt_bim.report.drawings.figures import Figure as Figure
from asbuilt_bim.report.drawings.figures import figures as figures
from asbuilt_bim.report.result.document import read_result as read_result
from asbuilt_bim.report.result.measure_document import measure_document as measure_document
from asbuilt_bim.report.result.parts import ResultSummary as ResultSummary
from asbuilt_bim.report.result.parts import read_elements as read_elements
from asbuilt_bim.report.result.parts import read_summary as read_summary
from asbuilt_bim.report.wording.notes import note_words as note_words
from asbuilt_bim.report.wording.reasons import words_of as words_of
from asbuilt_bim.report.wording.words import Words as Words
from asbuilt_bim.schedule.read import read_schedule as read_schedule
from asbuilt_bim.schedule.rows import ScheduleFile as ScheduleFile
from asbuilt_bim.version import __version__ as __version__
from asbuilt_bim.vision.masks.segment import Instance as Instance
from asbuilt_bim.vision.target.find import TargetSighting as TargetSighting

__all__ = [
    "AsBuiltError",
    "BimElement",
    "BimModel",
    "ElementProgress",
    "Figure",
    "Foreign",
    "Instance",
    "MeasureOptions",
    "MeasuredFace",
    "Note",
    "PairMeasurement",
    "ProgressReport",
    "Project",
    "Rejection",
    "ResultSummary",
    "Run",
    "ScheduleFile",
    "StereoRig",
    "TargetSighting",
    "Words",
    "__version__",
    "figures",
    "measure_document",
    "measure_pair",
    "note_words",
    "read_design",
    "read_elements",
    "read_project",
    "read_result",
    "read_rig",
    "read_schedule",
    "read_summary",
    "remake",
    "run",
    "save_measurement",
    "strip_asbuilt",
    "words_of",
    "write_asbuilt",
]
