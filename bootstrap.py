#!/usr/bin/env python3
"""Set everything up from a bare Python, and run: `python bootstrap.py run`, or `python bootstrap.py test`.

Needs nothing but CPython 3.11 or newer. What it installs goes into one folder: `.venv` here, or what the environment
variable ASBUILT_BIM_VENV names. A second time it installs nothing and starts at once. On Debian and Ubuntu, Python is
called `python3`.
"""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
SAMPLE = HERE / "sample_models" / "site" / "project.yaml"
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")
USAGE = """usage: python bootstrap.py run [options of asbuilt-bim run]    set up, then run the sample site into ./out
       python bootstrap.py test [options of pytest]               set up for development, then run the tests"""


def main() -> int:
    """Do what the command line says; return the exit code."""
    arguments = sys.argv[1:]
    if not arguments or arguments[0] not in ("run", "test"):
        print(USAGE)
        return 0 if arguments[:1] in (["-h"], ["--help"]) else 2
    if sys.version_info < (3, 11):  # noqa: UP036  (this file has to run there to say so)
        found = ".".join(map(str, sys.version_info[:3]))
        print(f"This is Python {found}; asbuilt-bim needs 3.11 or newer: https://www.python.org/downloads/")
        return 1
    command, rest = arguments[0], arguments[1:]
    if rest in (["-h"], ["--help"]):
        print(USAGE)
        return 0
    try:
        python = environment()
        install(python, "dev" if command == "test" else "print")
    except subprocess.CalledProcessError as problem:
        print(
            f"The set-up failed (exit code {problem.returncode}); the lines above say why. Mend that and run it again."
        )
        return 1
    if command == "test":
        for threads in ONE_THREAD:  # a process for each processor: threads beside them would only wait for each other
            os.environ.setdefault(threads, "1")
        return call([python, "-m", "pytest", *(rest or ["-n", "auto", "--dist", "loadfile"])])
    own = [] if rest and not rest[0].startswith("-") else [str(SAMPLE)]
    own += ["--out", str(Path.cwd() / "out")] if own and "--out" not in rest else []
    return call([python, "-P", "-m", "asbuilt_bim", "run", *own, *rest])


def environment() -> str:
    """Return the environment's Python, made where it isn't there yet."""
    folder = Path(os.environ.get("ASBUILT_BIM_VENV") or HERE / ".venv").absolute()
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if python.exists() and (folder / "pyvenv.cfg").exists():
        return str(python)
    try:
        import ensurepip  # noqa: F401  (Debian ships Python without it)
        import venv
    except ImportError:
        version = f"{sys.version_info[0]}.{sys.version_info[1]}"
        print("This Python can't make virtual environments. On Debian and Ubuntu, run first:")
        print(f"    sudo apt install python3-venv        (or python{version}-venv)")
        raise SystemExit(1) from None
    print(f"Making a virtual environment in {folder}")
    venv.create(folder, with_pip=True, clear=folder.exists())
    return str(python)


def install(python: str, extra: str) -> None:
    """Install the package where its requirements have changed since the last time."""
    wanted = hashlib.sha256((HERE / "pyproject.toml").read_bytes() + str(HERE).encode()).hexdigest()
    stamps = [Path(python).parent.parent / f"asbuilt-bim-{name}.stamp" for name in (extra, "dev")]
    if any(stamp.exists() and stamp.read_text() == wanted for stamp in stamps):  # dev holds all that run needs
        return
    print("Installing asbuilt-bim and its libraries (the first time some 200 MB are downloaded)", flush=True)
    pip = [python, "-P", "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "-q"]
    if not sys.dont_write_bytecode:
        pip += ["--no-compile"]  # what is imported is compiled then, and most is never imported: half a minute less
    subprocess.run([*pip, "-e", f"{HERE}[{extra}]"], check=True)
    stamps[0].write_text(wanted)


def call(command: list[str]) -> int:
    """Run a command in this terminal and return its exit code."""
    try:
        return subprocess.run(command, cwd=HERE if "pytest" in command else None).returncode
    except KeyboardInterrupt:
        return 1


if __name__ == "__main__":
    sys.exit(main())
