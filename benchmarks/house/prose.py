"""Count sentences and their words in README.md and docs/: a mean of at most 17, and none of over 30.

`python benchmarks/house/prose.py` prints a line a page; `--check` exits with 1 where a page falls short, `--json FILE`
writes the figures. Pages may be named instead. Code, tables, headings, HTML comments, pictures and the addresses of
links aren't counted. `code` in a line is one word. Each item of a list is a sentence of its own.
"""

from __future__ import annotations

import argparse
import io
import json
import re
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MOST_MEAN_WORDS = 17.0
"""What a page's sentences may have on average: plain English guides ask for 15 to 20."""
MOST_WORDS = 30
"""What one sentence may have."""
FENCE = re.compile(r"^ *(```|~~~).*?^ *\1[^\n]*$", re.MULTILINE | re.DOTALL)
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
PICTURE = re.compile(r"!\[[^\]]*\]\([^)]*\)")
LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
CODE = re.compile(r"(`+)[^`]+\1")
TAG = re.compile(r"</?[a-zA-Z][^>]*>")
ITEM = re.compile(r"^\s*(?:[-*+]|\d+[.)])\s+")
SENTENCE_END = re.compile(r"(?<=[.!?])[\"')*]*\s+(?=[\"'(*]*[A-Z])")
WORD = re.compile(r"\w")


@dataclass(frozen=True, slots=True, kw_only=True)
class PageCount:
    """The sentences of one page: how many, their words on average, and those that are too long."""

    page: str
    sentences: int
    mean_words: float
    longest_words: int
    too_long: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """Say whether the page keeps both limits."""
        return self.mean_words <= MOST_MEAN_WORDS and not self.too_long


def blocks(text: str) -> list[str]:
    """Return the paragraphs and list items of a page in Markdown, each on one line, without what isn't prose."""
    text = COMMENT.sub("", FENCE.sub("\n", text))
    text = TAG.sub("", LINK.sub(r"\1", PICTURE.sub("", CODE.sub("Code", text))))
    found = [""]
    for line in text.splitlines():
        plain = line.strip().lstrip("> ")
        if not plain or plain.startswith(("|", "#")):
            found.append("")
        elif ITEM.match(line):
            found.append(ITEM.sub("", line))
        else:
            found[-1] += " " + plain
    return [block.strip() for block in found if WORD.search(block)]


def sentences(text: str) -> list[str]:
    """Return the sentences of a page: a full stop, question or exclamation mark before a capital ends one."""
    return [one for block in blocks(text) for one in SENTENCE_END.split(block) if WORD.search(one)]


def words(sentence: str) -> int:
    """Count the words of a sentence: what holds a letter or a digit."""
    return sum(1 for word in sentence.split() if WORD.search(word))


def count(page: Path) -> PageCount:
    """Count one page."""
    found = sentences(page.read_text(encoding="utf-8"))
    lengths = [words(sentence) for sentence in found] or [0]
    return PageCount(
        page=page.resolve().relative_to(ROOT).as_posix() if page.resolve().is_relative_to(ROOT) else str(page),
        sentences=len(found),
        mean_words=sum(lengths) / len(lengths),
        longest_words=max(lengths),
        too_long=tuple(one for one in found if words(one) > MOST_WORDS),
    )


def main(arguments: list[str] | None = None) -> int:
    """Print the table and what is too long; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("pages", nargs="*", type=Path, help="Markdown pages; README.md and docs/*.md without them")
    parser.add_argument("--check", action="store_true", help="exit 1 where a page falls short")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    args = parser.parse_args(arguments)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(encoding="utf-8")  # a pipe on Windows has another
    counts = [count(page) for page in args.pages or [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]]
    print(f"{'page':<28} {'sentences':>9} {'mean':>6} {'longest':>8} {'over ' + str(MOST_WORDS):>8}")
    for one in counts:
        figures = f"{one.sentences:>9} {one.mean_words:>6.1f} {one.longest_words:>8} {len(one.too_long):>8}"
        print(f"{one.page:<28} {figures}  {'' if one.holds else 'FALLS SHORT'}".rstrip())
    for one in counts:
        for sentence in one.too_long:
            print(f"\n{one.page}, {words(sentence)} words: {sentence}")
    if args.json:
        args.json.write_text(json.dumps([asdict(one) for one in counts], indent=1) + "\n", encoding="utf-8")
    return 1 if args.check and not all(one.holds for one in counts) else 0


if __name__ == "__main__":
    sys.exit(main())
