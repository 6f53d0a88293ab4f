"""Reads damaged files, one a line of its input, within limits of memory and time; its answers are lines of JSON.

It is started by `inputs.py` and tests/fuzz, which end it where it hangs and begin another where it died.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
import traceback
import warnings
from pathlib import Path

from asbuilt_bim.errors import AsBuiltError
from benchmarks.hold.readers import damaged, sorts

MEMORY_BYTES = 3_000_000_000


def limit_memory() -> None:
    """Let this process have so much more memory than it has now, where the system can hold it to that."""
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (2 * MEMORY_BYTES, 2 * MEMORY_BYTES))  # addresses, not all of them used


def outcome(seed: int, folder: Path) -> dict[str, object]:
    """Read the file of a seed, and say what came of it."""
    sort, done, data = damaged(seed)
    for name, beside in sort.beside.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(beside)
    path = folder / sort.file
    path.write_bytes(data)
    begun = time.monotonic()
    answer = {"seed": seed, "sort": sort.name, "done": done}
    try:
        sort.read(path)
        told = "read"
    except AsBuiltError as refusal:
        told = "refused" if str(refusal).strip() and "Traceback" not in str(refusal) else "crash: an empty message"
    except BaseException as problem:
        where = traceback.extract_tb(problem.__traceback__)[-1]
        told = f"crash: {type(problem).__name__}: {str(problem)[:120]} ({Path(where.filename).name}:{where.lineno})"
    return answer | {"told": told, "seconds": round(time.monotonic() - begun, 2)}


def main() -> int:
    """Answer until the input ends."""
    warnings.simplefilter("ignore")
    sorts()
    limit_memory()
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(1, 2)
    print("ready", file=answers, flush=True)
    for line in sys.stdin:
        with tempfile.TemporaryDirectory(prefix="hold-") as folder:
            print(json.dumps(outcome(int(line), Path(folder))), file=answers, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
