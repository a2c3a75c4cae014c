"""TOML with line numbers: parsing, error messages with file and line, and writing."""

from __future__ import annotations

import difflib
import pathlib
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

# Keys and numbers of list elements that lead to a value.
Path = tuple[str | int, ...]

_TOKEN = re.compile(
    r"""(?P<skip>[ \t\r]+|\#[^\n]*)|(?P<newline>\n)|(?P<mark>[\[\]{},=.])
    |(?P<quoted>\"{3}(?:\\.|[^\\])*?\"{3}(?!\")|'{3}.*?'{3}(?!')|\"(?:\\.|[^\"\\])*\"|'[^']*')
    |(?P<bare>[^\s\[\]{},=.\#\"']+)""",
    re.DOTALL | re.VERBOSE,
)
_PLACE = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")


@dataclass(frozen=True, eq=False)
class Document:
    """Parsed TOML file.

    Parameters
    ----------
    name : str
        For messages.
    values : dict
    lines : dict of int
        The line, from 1 on, of each value by its path.
    """

    name: str
    values: dict[str, Any]
    lines: Mapping[Path, int]

    def error(self, path: Path, text: str) -> ValueError:
        """Error with the file and the line of a value, or of its parent.

        Parameters
        ----------
        path : tuple of str and int
        text : str

        Returns
        -------
        ValueError
        """
        known = (path[:end] for end in range(len(path), 0, -1))
        line = next((self.lines[part] for part in known if part in self.lines), 1)
        return ValueError(f"{self.name}:{line}: {text}")


@dataclass(frozen=True, eq=False)
class Place:
    """Position of a value in a file, and the files that may be read from there.

    Parameters
    ----------
    document : Document
    folder : pathlib.Path
        Of the file; names of files are relative to it.
    outside : bool
        Whether files elsewhere may be read.
    keys : tuple of str and int
    """

    document: Document
    folder: pathlib.Path
    outside: bool = False
    keys: Path = ()

    def at(self, key: str | int) -> Place:
        """Position of a part of the value."""
        return Place(self.document, self.folder, self.outside, (*self.keys, key))

    def error(self, text: str) -> ValueError:
        """Error that names file, line and key."""
        words = [key for key in self.keys if isinstance(key, str)]
        return self.document.error(self.keys, f"{'.'.join(words)}: {text}" if words else text)

    def file(self, text: Any) -> pathlib.Path:
        """Path of a file that a scene file names."""
        if not isinstance(text, str) or not text:
            raise self.error(f"expected the name of a file, got {text!r}")
        path = (self.folder / text).resolve()
        if not (self.outside or path.is_relative_to(self.folder.resolve())):
            raise self.error(
                f"expected a file in the folder of the scene file, got {text!r}; others only with "
                "allow_outside=True, or --allow-outside"
            )
        return path


def choice(given: Any, known: Iterable[str]) -> str:
    """Error text for an unknown word, with the nearest known one.

    Parameters
    ----------
    given : Any
    known : iterable of str

    Returns
    -------
    str
    """
    words = list(known)
    near = difflib.get_close_matches(str(given), words, n=1)
    hint = f", did you mean {near[0]!r}?" if near else ""
    return f"expected one of {', '.join(words)}, got {given!r}{hint}"


def parse(text: str, name: str) -> Document:
    """Parse a TOML text into values and their lines.

    Parameters
    ----------
    text : str
    name : str
        Of the file, for messages.

    Returns
    -------
    Document

    Raises
    ------
    ValueError
        If it is no TOML; says file and line.
    """
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = _PLACE.search(str(error))
        line = int(place[1]) if place and place[1] else text.count("\n") + 1
        what = _PLACE.sub("", str(error))
        raise ValueError(f"{name}:{line}: expected TOML, got something that does not parse: {what}") from None
    return Document(name, values, _Scan(text).lines)


def dump(values: Mapping[str, Any]) -> str:
    """TOML text of nested dicts, lists, text and numbers.

    Parameters
    ----------
    values : dict

    Returns
    -------
    str
        Numbers have all their digits.
    """
    import tomlkit

    return tomlkit.dumps(values)


def _tokens(text: str) -> Iterator[tuple[str, str, int]]:
    """Kind, text and line of each token, to the end, which is of kind ""."""
    line = 1
    for match in _TOKEN.finditer(text):
        if match.lastgroup != "skip":
            yield str(match.lastgroup), match[0], line
        line += match[0].count("\n")
    yield "", "", line


class _Scan:
    """Lines of the values of a text that is known to be TOML."""

    def __init__(self, text: str) -> None:
        self.lines: dict[Path, int] = {}
        self.counts: dict[Path, int] = {}  # the last element of each array of tables
        self.rest = _tokens(text)
        self.kind, self.text, self.line = next(self.rest)
        table: Path = ()
        while self.kind:
            if self.kind == "newline":
                self.step()
            elif self.text == "[" and self.kind == "mark":
                table = self.header()
            else:
                self.pair(table)

    def step(self) -> None:
        self.kind, self.text, self.line = next(self.rest)

    def sees(self, marks: str) -> bool:
        return self.kind == "mark" and self.text in marks

    def keys(self) -> list[str]:
        """The parts of a dotted key."""
        parts = []
        while self.kind in ("bare", "quoted") or self.sees("."):
            if self.kind == "quoted":
                parts.append(tomllib.loads(f"key = {self.text}")["key"])
            elif self.kind == "bare":
                parts.append(self.text)
            self.step()
        return parts

    def header(self) -> Path:
        """The path of a table, or of the next one of an array of tables."""
        line, depth = self.line, 0
        while self.sees("["):
            self.step()
            depth += 1
        path: Path = ()
        parts = self.keys()
        for number, part in enumerate(parts):
            path += (part,)
            if depth == 2 and number == len(parts) - 1:
                self.counts[path] = self.counts.get(path, -1) + 1
            self.note(path, line)
            if path in self.counts:
                path += (self.counts[path],)
                self.note(path, line)
        while self.sees("]"):
            self.step()
        return path

    def note(self, path: Path, line: int) -> None:
        self.lines.setdefault(path, line)

    def pair(self, table: Path) -> None:
        """A key and its value."""
        path, line = table, self.line
        for part in self.keys():
            path += (part,)
            self.note(path, line)
        self.step()  # =
        self.value(path)

    def value(self, path: Path) -> None:
        self.note(path, self.line)
        if self.sees("["):
            self.within(lambda number: self.value((*path, number)), "]")
        elif self.sees("{"):
            self.within(lambda _: self.pair(path), "}")
        else:
            while self.kind not in ("newline", "") and not self.sees(",]}"):
                self.step()

    def within(self, one: Any, end: str) -> None:
        """Each of what stands between brackets."""
        self.step()
        number = 0
        while not self.sees(end):
            if self.kind == "newline" or self.sees(","):
                self.step()
            else:
                one(number)
                number += 1
        self.step()
