"""Whether a web viewer shows each element of a coloured copy in its state's colour, by web-ifc in Chromium.

npm install --prefix /tmp/viewer web-ifc
.venv/bin/asbuilt-bim run sample_models/site/project.yaml --out out --colour
.venv/bin/python .ci/viewer.py /tmp/viewer/node_modules/web-ifc out picture.png

Prints a line for each element whose colour is another's, and how many are right; exit 1 where one isn't. Serves the
files on a loopback port. The picture leaves out what isn't in scope: a slab would hide what stands under it.
"""

from __future__ import annotations

import functools
import http.server
import json
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # the root of the project

from asbuilt_bim.report.drawings.colours import STATE_COLOURS
from asbuilt_bim.report.result.document import read_result
from benchmarks.chromium import CHROMIUM

FOLDER = Path(__file__).parent
TOLERANCE = 1.0 / 255.0


class Handler(http.server.BaseHTTPRequestHandler):
    """Serves the page, web-ifc and the model, and keeps what the page posts."""

    def __init__(self, files: dict[str, Path], kept: dict[str, Any], *args: Any) -> None:
        self._files, self._kept = files, kept
        super().__init__(*args)

    def do_GET(self) -> None:
        """Send a file by its address."""
        path = self._files.get(self.path)
        self.send_response(200 if path else 404)
        if path:
            kind = {".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm"}
            self.send_header("Content-Type", kind.get(path.suffix, "application/octet-stream"))
        self.end_headers()
        self.wfile.write(path.read_bytes() if path else b"")

    def do_POST(self) -> None:
        """Keep each element's colours."""
        self._kept.update(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(200)
        self.end_headers()

    def log_message(self, *_: Any) -> None:
        """Say nothing of requests."""


def shown_colours(web_ifc: Path, model: Path, picture: Path, scope: Path) -> dict[str, list[list[float]]]:
    """Return GlobalId -> colours (r, g, b from 0 to 1) as web-ifc gives them, and write a picture."""
    files = {"/": FOLDER / "viewer.html", "/model.ifc": model, "/scope.json": scope}
    files |= {f"/web-ifc/{path.name}": path for path in web_ifc.iterdir()}
    kept: dict[str, Any] = {}
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Handler, files, kept))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    command = [CHROMIUM, "--headless", "--no-sandbox", "--hide-scrollbars", "--window-size=1200,800"]
    command += ["--virtual-time-budget=60000", f"--screenshot={picture}", f"http://127.0.0.1:{server.server_port}/"]
    subprocess.run(command, check=True, capture_output=True, timeout=300)
    server.shutdown()
    return kept


def main() -> int:
    """Compare the viewer's colours with the states' in result.json."""
    web_ifc, out, picture = map(Path, sys.argv[1:4])
    report = read_result(out / "result.json")
    with tempfile.TemporaryDirectory() as folder:
        scope = Path(folder) / "scope.json"
        scope.write_text(json.dumps([one.global_id for one in report.elements]), encoding="utf-8")
        shown = shown_colours(web_ifc, next(out.glob("*.asbuilt.ifc")), picture.resolve(), scope)
    right = 0
    for element in report.elements:
        wanted = [int(STATE_COLOURS[element.shown_state][k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
        found = shown.get(element.global_id, [])
        own = bool(found) and all(abs(a - b) <= TOLERANCE for one in found for a, b in zip(one, wanted, strict=True))
        right += own
        if not own:
            print(f"{element.name}: {element.shown_state} should be {wanted}, and is {found or shown.get('problem')}")
    print(f"{right} of {len(report.elements)} elements in their state's colour; picture: {picture}")
    return 0 if right == len(report.elements) else 1


if __name__ == "__main__":
    sys.exit(main())
