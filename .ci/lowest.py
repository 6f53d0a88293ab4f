"""Print the lowest version that each pin of pyproject.toml allows, a requirement a line."""

import re
import sys
import tomllib
from pathlib import Path

PIN = re.compile(r"([\w.-]+)>=([\d.]+)")

project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
for requirement in project["dependencies"]:
    name, lowest = PIN.match(requirement).groups()
    sys.stdout.write(f"{name}=={lowest}\n")
