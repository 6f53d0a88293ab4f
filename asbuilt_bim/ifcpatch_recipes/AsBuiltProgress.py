"""An `ifcpatch` recipe: an asbuilt-bim result onto an IFC file, in any chain of IfcOpenShell's tools.

    export IFCPATCH_RECIPE_DIR=$(asbuilt-bim ifcpatch-dir)
    python -m ifcpatch -r AsBuiltProgress -i in.ifc -o out.ifc -a result.json

`ifcpatch` loads it by its path, and the class by its name; names and the form of the docstring below are what it wants.
"""

import logging
import sys
from typing import Any

from asbuilt_bim.errors import AsBuiltError, ResultError
from asbuilt_bim.flow.output.folder import read_current
from asbuilt_bim.ifc.read.circles import refuse_circles
from asbuilt_bim.ifc.read.source import SCHEMAS
from asbuilt_bim.ifc.write.copy import mark_file
from asbuilt_bim.report.result.document import read_before, read_result
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.storage.regular_file import path_of

_FILE = "the file that ifcpatch was given"


class Patcher:
    """Writes progress and as-built areas of a result into the file."""

    def __init__(self, file: Any, logger: logging.Logger | None = None, result: str = "result.json"):
        """Write what asbuilt-bim found out on a building site

        Elements get their as-built areas and completion, storeys, tasks and cost items theirs, as in the copy that
        `asbuilt-bim run` writes. What an earlier result had written is replaced; a second run changes nothing. Earlier
        visits come from the run that the result belongs to, where it is still in its folder.

        :param result: The result.json of an asbuilt-bim run, made from this IFC file.
        :filter_glob result: *.json

        Example:

        .. code:: python

            ifcpatch.execute({"file": model, "recipe": "AsBuiltProgress", "arguments": ["out/result.json"]})
        """
        self.file = file
        self.logger = logger or logging.getLogger("IFCPatch")
        self.result = result

    def patch(self) -> None:
        """Write the result into the file.

        Raises:
            AsBuiltError: the result is missing, damaged, or of another design.
        """
        try:
            self._patch()
        except AsBuiltError as problem:
            if not _on_the_command_line():
                raise
            self.logger.error("AsBuiltProgress: %s", problem)
            raise SystemExit(f"error: AsBuiltProgress: {problem}") from None

    def _patch(self) -> None:
        if self.file is None or self.file.schema not in SCHEMAS:
            schema = "no file" if self.file is None else f"schema {self.file.schema}"
            raise ResultError(f"{schema} is not supported; give an IFC file of {', '.join(SCHEMAS)}")
        refuse_circles(self.file, _FILE)
        path = path_of(self.result, "result")
        report = read_result(path)
        folder = path.resolve().parent
        current = read_current(folder)  # beside the copy in the output folder
        earlier = read_before(current.folder if current else folder, report.visit_date)
        mark_file(self.file, report, earlier=earlier, words=note_words, name=_FILE)
        self.logger.info("AsBuiltProgress: wrote %s, visit of %s", path, report.visit_date)


def _on_the_command_line() -> bool:
    """Say whether `python -m ifcpatch` called: it would answer a mistake of the user's with a traceback."""
    spec = getattr(sys.modules.get("__main__"), "__spec__", None)
    return spec is not None and spec.name == "ifcpatch.__main__"
