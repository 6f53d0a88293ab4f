"""What a YAML parser complains of, in the words of those who write the file: which line, and what to do there."""

from __future__ import annotations

import re

import yaml

_MOST_SHOWN = 60
_WORDS = (
    (r"mapping values are not allowed",
     "a key can't stand here: indent the line as the lines are that it belongs with, or put a value that holds ': ' "
     "in quotes"),
    (r"expected <block end>",
     "is indented otherwise than the lines before it that it belongs with"),
    (r"expected ',' or '([\]}])'", "a bracket that was opened in line {context} isn't closed by {0}"),
    (r"unexpected end of stream", "a quote that was opened in line {context} is never closed"),
    (r"could not find expected ':'", "'key: value' is expected in line {context}, with a space after the colon"),
    (r"found character '\\t'", "holds a tab; indent with spaces"),
    (r"found character '(.)' that cannot start", "a value can't begin with {0}; put it in quotes"),
    (r"unknown escape character", "a \\ in double quotes begins a code: write / in paths, or use single quotes"),
    (r"expected escape sequence", "a \\ in double quotes begins a code: write / in paths, or use single quotes"),
    (r"another document", "a second document begins here (---): keep one in a file"),
)  # fmt: skip


def yaml_words(problem: yaml.MarkedYAMLError, text: str) -> str:
    """Return `, line N: what is wrong there` of a YAML text, with the line itself where that helps."""
    mark = problem.problem_mark or problem.context_mark
    what = problem.problem or problem.context or "not YAML"
    if mark is None:
        return f": {what}"
    context = (problem.context_mark or mark).line + 1
    for pattern, words in _WORDS:
        if found := re.search(pattern, what):
            told = words.format(*found.groups(), context=context)
            return f", line {mark.line + 1}{_shown(text, mark.line)}: {told}"
    return f", line {mark.line + 1}: {what}"


def character_words(problem: yaml.reader.ReaderError, text: str) -> str:
    """Return `, line N: ...` of a character that no YAML text may hold."""
    line = text.count("\n", 0, problem.position) + 1
    return f", line {line}: holds a character that no text has (U+{ord(text[problem.position]):04X}); take it out"


def _shown(text: str, line: int) -> str:
    lines = text.splitlines()
    own = "".join(c for c in lines[line].strip() if c.isprintable()) if line < len(lines) else ""
    return f" ({own[:_MOST_SHOWN]})" if own else ""
