"""IFC files made to lead a reader astray, each given to the real command: refused by name, soon, in little memory.

python benchmarks/hold/ifc_hostile.py --check            every sort, and 40 seeded mutations by entity
python benchmarks/hold/ifc_hostile.py --check --quick    every sort once, by `inspect` alone

Each file is the sample's design with one thing wrong: a circle, a tree that doubles at every level, an entity made one
of another class. `inspect` and `strip` get it in a process of their own. Those that must be refused give exit 1 and a
message that names the file; a mutation may also be harmless. No traceback, under 60 s of processor time, under 3 GB.
"""

from __future__ import annotations

import os
import random
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from benchmarks.sites import SAMPLE
from benchmarks.table import Line, line, options, report, told

LIMIT_S, LIMIT_BYTES = 60.0, 3e9
OWN_FAULT = "the fault is its own"
MUTATIONS = 40
SEED = 20260401
_ENTITY = re.compile(r"^#(\d+)=(IFC[A-Z0-9]+)\((.*)\);$", re.MULTILINE)
Change = Callable[["Model", random.Random], None]


@dataclass(slots=True)
class Model:
    """A file's entities as text, by number."""

    head: str
    tail: str
    entities: dict[int, tuple[str, str]]

    @classmethod
    def read(cls, path: Path) -> Model:
        """Read a STEP file whose entities stand one on a line."""
        text = path.read_text(encoding="utf-8").replace("\r\n", "\n")
        found = list(_ENTITY.finditer(text))
        entities = {int(one[1]): (one[2], one[3]) for one in found}
        return cls(head=text[: found[0].start()], tail=text[found[-1].end() :], entities=entities)

    def write(self, path: Path) -> None:
        """Write the file."""
        lines = (f"#{number}={name}({values});" for number, (name, values) in self.entities.items())
        path.write_text(self.head + "\n".join(lines) + self.tail, encoding="utf-8")

    def of(self, *names: str) -> list[int]:
        """Return the numbers of the entities of some classes."""
        return [number for number, (name, _) in self.entities.items() if name in names]

    def add(self, name: str, values: str) -> int:
        """Add an entity; return its number."""
        number = max(self.entities) + 1
        self.entities[number] = (name, values)
        return number

    def put(self, number: int, place: int, value: str) -> None:
        """Set an entity's attribute."""
        name, values = self.entities[number]
        parts = _split(values)
        parts[place] = value
        self.entities[number] = (name, ",".join(parts))

    def get(self, number: int, place: int) -> str:
        """Return an entity's attribute."""
        return _split(self.entities[number][1])[place]

    def body(self, dice: random.Random) -> int:
        """Return the representation of a wall or column."""
        product = dice.choice(self.of("IFCWALL", "IFCCOLUMN"))
        shape = int(self.get(product, 6)[1:])
        return int(self.get(shape, 2).strip("()").split(",")[0][1:])


def _split(values: str) -> list[str]:
    parts, depth, quoted, start = [], 0, False, 0
    for at, sign in enumerate(values):
        quoted ^= sign == "'"
        depth += 0 if quoted else (sign == "(") - (sign == ")")
        if sign == "," and depth == 0 and not quoted:
            parts.append(values[start:at])
            start = at + 1
    return [*parts, values[start:]]


def placement_on_itself(model: Model, dice: random.Random) -> None:
    """Place a thing on itself."""
    one = dice.choice(model.of("IFCLOCALPLACEMENT"))
    model.put(one, 0, f"#{one}")


def placements_in_a_ring(model: Model, dice: random.Random) -> None:
    """Place things on each other in a ring."""
    ring = dice.sample(model.of("IFCLOCALPLACEMENT"), dice.randint(2, 9))
    for one, other in zip(ring, ring[1:] + ring[:1], strict=True):
        model.put(one, 0, f"#{other}")


def storey_on_its_element(model: Model, dice: random.Random) -> None:
    """Place the storeys on an element of theirs."""
    element = model.get(dice.choice(model.of("IFCWALL", "IFCCOLUMN")), 5)
    for storey in model.of("IFCBUILDINGSTOREY"):
        model.put(int(model.get(storey, 5)[1:]), 0, element)


def placements_20000_deep(model: Model, dice: random.Random) -> None:
    """Place an element at the end of a long chain."""
    product = dice.choice(model.of("IFCWALL", "IFCCOLUMN"))
    last = model.get(product, 5)
    axes = model.get(int(last[1:]), 1)
    for _ in range(20_000):
        last = f"#{model.add('IFCLOCALPLACEMENT', f'{last},{axes}')}"
    model.put(product, 5, last)


def opening_made_a_column(model: Model, dice: random.Random) -> None:
    """Make an opening a column or a wall."""
    one = dice.choice(model.of("IFCOPENINGELEMENT"))
    model.entities[one] = (dice.choice(["IFCCOLUMN", "IFCWALL"]), model.entities[one][1])


def opening_made_a_slab(model: Model, dice: random.Random) -> None:
    """Make an opening a slab."""
    one = dice.choice(model.of("IFCOPENINGELEMENT"))
    model.entities[one] = ("IFCSLAB", model.entities[one][1])


def boolean_in_itself(model: Model, dice: random.Random) -> None:
    """Cut a solid by itself."""
    body = model.body(dice)
    items = model.get(body, 3).strip("()")
    one = model.add("IFCBOOLEANRESULT", f".UNION.,{items},{items}")
    model.put(one, dice.choice([1, 2]), f"#{one}")
    model.put(body, 3, f"(#{one})")


def boolean_tree(model: Model, dice: random.Random) -> None:
    """Cut a solid 2^24 times, in few entities."""
    body = model.body(dice)
    last = model.get(body, 3).strip("()")
    for _ in range(24):
        last = f"#{model.add('IFCBOOLEANRESULT', f'.UNION.,{last},{last}')}"
    model.put(body, 3, f"({last})")


def boolean_nest(model: Model, dice: random.Random) -> None:
    """Cut a solid 20,000 times, one cut in the other."""
    body = model.body(dice)
    first = last = model.get(body, 3).strip("()")
    for _ in range(20_000):
        last = f"#{model.add('IFCBOOLEANRESULT', f'.DIFFERENCE.,{last},{first}')}"
    model.put(body, 3, f"({last})")


def boolean_bush(model: Model, dice: random.Random) -> None:
    """Unite some walls and columns 400 times with themselves: no more than is allowed, and slow to draw."""
    for body in {model.body(dice) for _ in range(8)}:
        first = last = model.get(body, 3).strip("()")
        for _ in range(400):
            last = f"#{model.add('IFCBOOLEANRESULT', f'.UNION.,{last},{first}')}"
        model.put(body, 3, f"({last})")


def units_of_each_other(model: Model, dice: random.Random) -> None:
    """Have units of length convert to each other."""
    size = model.add("IFCDIMENSIONALEXPONENTS", "1,0,0,0,0,0,0")
    count = dice.randint(1, 4)
    first = max(model.entities) + 1
    for number in range(count):
        after = first + 2 * ((number + 1) % count)
        model.add("IFCCONVERSIONBASEDUNIT", f"#{size},.LENGTHUNIT.,'odd',#{first + 2 * number + 1}")
        model.add("IFCMEASUREWITHUNIT", f"IFCRATIOMEASURE(2.),#{after}")
    assignment = model.of("IFCUNITASSIGNMENT")[0]
    length = next(one for one in model.of("IFCSIUNIT") if model.get(one, 1) == ".LENGTHUNIT.")
    values = model.entities[assignment][1]
    model.entities[assignment] = ("IFCUNITASSIGNMENT", re.sub(rf"#{length}\b", f"#{first}", values))


def map_of_itself(model: Model, dice: random.Random) -> None:
    """Draw a thing by a copy of itself."""
    body = model.body(dice)
    point = model.add("IFCCARTESIANPOINT", "(0.,0.,0.)")
    origin = model.add("IFCAXIS2PLACEMENT3D", f"#{point},$,$")
    source = model.add("IFCREPRESENTATIONMAP", f"#{origin},#{body}")
    target = model.add("IFCCARTESIANTRANSFORMATIONOPERATOR3D", f"$,$,#{point},$,$")
    model.put(body, 3, f"(#{model.add('IFCMAPPEDITEM', f'#{source},#{target}')})")


def maps_that_double(model: Model, dice: random.Random) -> None:
    """Draw a thing by 2^24 copies, in few entities."""
    body = model.body(dice)
    point = model.add("IFCCARTESIANPOINT", "(0.,0.,0.)")
    origin = model.add("IFCAXIS2PLACEMENT3D", f"#{point},$,$")
    target = model.add("IFCCARTESIANTRANSFORMATIONOPERATOR3D", f"$,$,#{point},$,$")
    context, items = model.get(body, 0), model.get(body, 3)
    for _ in range(24):
        inner = model.add("IFCSHAPEREPRESENTATION", f"{context},'Body','MappedRepresentation',{items}")
        source = model.add("IFCREPRESENTATIONMAP", f"#{origin},#{inner}")
        both = [model.add("IFCMAPPEDITEM", f"#{source},#{target}") for _ in range(2)]
        items = f"(#{both[0]},#{both[1]})"
    model.put(body, 3, items)


def aggregate_in_itself(model: Model, dice: random.Random) -> None:
    """Make two elements parts of each other."""
    one, other = dice.sample(model.of("IFCWALL", "IFCCOLUMN"), 2)
    for whole, parts in ((one, (one, other)), (other, (one, other))):
        listed = ",".join(f"#{part}" for part in parts)
        model.add("IFCRELAGGREGATES", f"'{_guid(dice)}',$,$,$,#{whole},({listed})")


def profile_of_itself(model: Model, dice: random.Random) -> None:
    """Compose a profile of itself."""
    solid = int(model.get(model.body(dice), 3).strip("()")[1:])
    one = max(model.entities) + 1
    model.add("IFCCOMPOSITEPROFILEDEF", f".AREA.,$,(#{one},{model.get(solid, 0)}),$")
    model.put(solid, 0, f"#{one}")


def curve_of_itself(model: Model, dice: random.Random) -> None:
    """Trim a curve out of itself."""
    solid = int(model.get(model.body(dice), 3).strip("()")[1:])
    point = model.add("IFCCARTESIANPOINT", "(0.,0.)")
    curve = max(model.entities) + 1
    model.add("IFCTRIMMEDCURVE", f"#{curve},(#{point}),(#{point}),.T.,.CARTESIAN.")
    model.put(solid, 0, f"#{model.add('IFCARBITRARYCLOSEDPROFILEDEF', f'.AREA.,$,#{curve}')}")


def context_of_itself(model: Model, dice: random.Random) -> None:
    """Make a context part of itself."""
    one = dice.choice(model.of("IFCGEOMETRICREPRESENTATIONSUBCONTEXT"))
    model.put(one, 6, f"#{one}")


REFUSED: dict[str, Change] = {
    change.__name__.replace("_", " "): change
    for change in (
        placement_on_itself, placements_in_a_ring, storey_on_its_element, placements_20000_deep, opening_made_a_column,
        opening_made_a_slab, boolean_in_itself, boolean_tree, boolean_nest, units_of_each_other, map_of_itself,
        maps_that_double, aggregate_in_itself, profile_of_itself, curve_of_itself, context_of_itself,
    )
}  # fmt: skip


def mutation(model: Model, dice: random.Random) -> None:
    """Make a few entities of another class, or have them refer to others."""
    numbers = list(model.entities)
    for _ in range(dice.randint(1, 4)):
        one, other = dice.sample(numbers, 2)
        name, values = model.entities[one]
        if dice.random() < 0.5:
            model.entities[one] = (model.entities[other][0], values)
        elif references := re.findall(r"#\d+", values):
            old = dice.choice(references)
            model.entities[one] = (name, re.sub(rf"{old}\b", f"#{dice.choice([one, other])}", values, count=1))


def _guid(dice: random.Random) -> str:
    return "0" + "".join(dice.choices("0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdef", k=21))


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """How a command took a file: its exit code, words, processor time and greatest memory."""

    code: int
    said: str
    seconds: float
    memory_bytes: float


def ask(words: list[str], cwd: str | None = None, env: Mapping[str, str] | None = None) -> Told:
    """Run the command within the limits of a benchmark, not of the program: twice those, then it is ended."""
    with tempfile.TemporaryFile() as said:
        command = [sys.executable, "-m", "asbuilt_bim", *words]
        process = subprocess.Popen(command, stdout=said, stderr=said, cwd=cwd, env=env)
        _, status, usage = _wait(process.pid)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read().decode("utf-8", "replace")
    return Told(
        code=process.returncode, said=text, seconds=usage.ru_utime + usage.ru_stime,
        memory_bytes=usage.ru_maxrss * 1024.0,
    )  # fmt: skip


def _wait(process: int) -> tuple[int, int, object]:
    late = time.monotonic() + 20 * LIMIT_S
    while time.monotonic() < late:
        found = os.wait4(process, os.WNOHANG)
        if found[0]:
            return found
        time.sleep(0.05)
    os.kill(process, 9)
    return os.wait4(process, 0)


def main() -> int:
    """Make the files, ask the command, and print what it said."""
    parser = options(__doc__ or "")
    parser.add_argument("--seed", type=int, default=SEED)
    args = parser.parse_args()
    asked: list[tuple[str, str, Told, bool]] = []
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-hostile-") as folder:
        jobs = [(name, change, True) for name, change in REFUSED.items()]
        jobs += [] if args.quick else [("boolean bush", boolean_bush, False)]  # runs to the limit
        jobs += [] if args.quick else [(f"mutation {i}", mutation, False) for i in range(MUTATIONS)]
        for number, (name, change, refused) in enumerate(jobs):
            model, path = Model.read(SAMPLE / "design.ifc"), Path(folder) / f"{name.replace(' ', '-')}.ifc"
            change(model, random.Random(f"{args.seed} {name}"))
            model.write(path)
            words = [["inspect", str(path)], ["strip", str(path), "--out", str(path.with_suffix(".out"))]]
            for one in words[: 1 if args.quick or number % 2 else 2]:
                said = ask(one)
                plain = "Traceback" not in said.said and OWN_FAULT not in said.said
                named = said.code == 1 and path.name in said.said.replace("\n", "")
                holds = plain and (named or (not refused and said.code == 0))
                asked.append((name, one[0], said, holds))
                print(f"  {name:<24} {one[0]:<8} {said.code} {said.seconds:5.1f} s  {_short(said)}", file=sys.stderr)
    lines = _lines(asked)
    for name, command, said, holds in asked:
        if not holds:
            print(f"  fault: {command} {name}: exit {said.code}: {said.said[-300:]}")
    rows = {f"{name}, {command}": [said.code, round(said.seconds, 1), _short(said)] for name, command, said, _ in asked}
    return report(f"Hostile IFC files (seed {args.seed})", lines, args, rows=rows)


def _lines(asked: list[tuple[str, str, Told, bool]]) -> list[Line]:
    slowest, most = max(one.seconds for _, _, one, _ in asked), max(one.memory_bytes for _, _, one, _ in asked)
    held, count = sum(holds for *_, holds in asked), len(asked)
    return [
        line("refused by name, or harmless", f"{held} of {count}", "all", count, held == count, 15),
        line("slowest, processor time", f"{slowest:.0f} s", f"{LIMIT_S:.0f} s", count, slowest <= LIMIT_S, 15),
        line("most memory", f"{most / 1e9:.1f} GB", f"{LIMIT_BYTES / 1e9:.0f} GB", count, most <= LIMIT_BYTES, 15),
        told("refused", str(sum(one.code == 1 for _, _, one, _ in asked)), count),
    ]


def _short(said: Told) -> str:
    return " ".join(said.said.split("error:")[-1].split())[-160:] if said.code else ""


if __name__ == "__main__":
    sys.exit(main())
