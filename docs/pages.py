"""Write the program's output into the pages: results of commands, files, pictures, tables of keys, rules, templates.

    python docs/pages.py                     all pages
    python docs/pages.py tutorial README     only these pages

Pages are committed with the output, so they read equally on a code host and on the site. These parts are written:

* A ``console`` block whose lines begin with ``$ sitscad`` or ``$ python``. Each command is run, and its output follows.
  The line before the block can limit the output, or set an exit code other than 0:
  ``<!-- exit 1, first 12, last 2 -->`` (lines).

* A block after ``<!-- file NAME -->`` is stored as a file for the commands below. A block after ``<!-- shows PATH -->``
  contains the text of this file.

* A picture after ``<!-- picture PATH -->`` is a copy of this file.

* ``<!-- run COMMAND -->`` is run without output.

* Everything below the mark in ``library.md``, ``rules.md``, ``templates.md`` and ``spec.md``.

The commands of a page run in an empty folder. Its links ``templates`` and ``docs`` lead into the repository.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import attribute_tables
import spec_reference

from sitscad import load, measure
from sitscad.apps.study.sweeping import value_text

ROOT = Path(__file__).parents[1]
PAGES = {path.stem: path for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))}
MARK = "<!-- Below this line the page is written by docs/pages.py. -->\n"
REFUSED = {"grasper_3p5mm"}
"""Templates that `check` must refuse."""
LONGEST = 600.0
"""Time limit (s) of a command."""
RUN = r"^<!-- run (?P<run>[^\n]+) -->$"
COMMENT = r"(?:<!-- (?P<told>(?:exit|first|last|file|shows|picture) [^\n]*?) -->\n)?"
FENCE = r"^```(?P<language>\w+)\n(?P<text>.*?)^```$"
PICTURE = r"^!\[[^\]]*\]\((?P<target>[^)]+)\)$"
MADE = re.compile(f"{RUN}|{COMMENT}(?:{FENCE}|{PICTURE})", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Making:
    """One page in progress: the folder of its commands, and the files to write beside the page."""

    page: Path
    folder: Path
    written: dict[Path, bytes] = field(default_factory=dict)

    def whole(self) -> dict[Path, bytes]:
        """Return the page and its pictures with new output."""
        for name in ("templates", "docs"):
            (self.folder / name).symlink_to(ROOT / name)
        kept, mark, _ = self.page.read_text(encoding="utf-8").partition(MARK)
        text = MADE.sub(self._made, kept) + (f"{mark}\n{self._below()}" if mark else "")
        return {self.page: text.encode(), **self.written}

    def _made(self, found: re.Match[str]) -> str:
        """Return one block or picture with its new content."""
        told = found["told"] or ""
        what, _, path = told.partition(" ")
        if found["run"]:
            self._ran(found["run"])
        elif found["target"]:
            if what == "picture":
                self.written[self.page.parent / found["target"]] = (self.folder / path).read_bytes()
        elif what == "file":
            (self.folder / path).write_text(found["text"], encoding="utf-8")
        elif what == "shows":
            return f"<!-- {told} -->\n```{found['language']}\n{(self.folder / path).read_text(encoding='utf-8')}```"
        elif found["language"] == "console" and found["text"].startswith(("$ sitscad", "$ python")):
            comment = f"<!-- {told} -->\n" if told else ""
            return f"{comment}```console\n{''.join(self._session(found['text'], told))}```"
        return found[0]

    def _session(self, text: str, told: str) -> Iterator[str]:
        """Yield each command of a block with the selected lines of its output."""
        asked = {word: int(number) for word, number in re.findall(r"(exit|first|last) (\d+)", told)}
        for line in re.findall(r"^\$ (.+)$", text, re.MULTILINE):
            said = self._ran(line, asked.get("exit", 0)).splitlines(keepends=True)
            last = asked.get("last", 0)
            first = asked.get("first", 0 if last else len(said))
            yield f"$ {line}\n"
            yield from said[:first]
            yield from ["...\n"] if len(said) > first + last else []
            yield from said[max(first, len(said) - last) :]

    def _ran(self, line: str, exit_code: int = 0) -> str:
        """Return the output of a command, with its messages, on a terminal of 100 columns."""
        words = shlex.split(line)
        python = [sys.executable, *(("-m", "sitscad") if words[0] == "sitscad" else ())]
        environment = {**os.environ, "NO_COLOR": "1", "COLUMNS": "100", "MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)}
        ran = subprocess.run(
            [*python, *words[1:]], cwd=self.folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, timeout=LONGEST,
        )
        if ran.returncode != exit_code:
            raise ValueError(f"{self.page.name}: {line} ended with {ran.returncode}, not {exit_code}:\n{ran.stdout}")
        return ran.stdout

    def _below(self) -> str:
        """Return the text below the mark."""
        if self.page.stem == "spec":
            return spec_reference.reference()
        if self.page.stem == "library":
            return attribute_tables.tables()
        if self.page.stem == "rules":
            return self._ran("sitscad rules --format markdown").partition("\n")[2].lstrip()
        paths = sorted((ROOT / "templates").glob("*.yaml"))
        heads = "| template | resolution of the normal force | L | Rp | amplitude | margin in the jaw | study |\n"
        heads += 7 * "|---" + "|\n"
        page = heads + "".join((*map(self._row, paths), *map(self._template, paths)))
        self.written[self.page.parent / "pictures" / "gallery.svg"] = gallery(self.written)
        return page

    def _row(self, path: Path) -> str:
        """Return the row of a template: five figures, and the studies around it."""
        measures = ("resolution.normal", "inductance", "rp", "amplitude", "fit.spare")
        spec = load(path)
        found = measure(spec, level="full", measures=measures).values
        told = (value_text(name, found[name][0], 3) if name in found else "-" for name in measures)
        studies = (f"[{study.stem}](studies.md)" for study in sorted((ROOT / "templates/studies").glob("*.yaml"))
                   if re.search(rf"base: (\.\./)?{path.name}", study.read_text(encoding="utf-8")))
        return f"| [{path.stem}](#{path.stem}) | {' | '.join(told)} | {', '.join(studies) or '-'} |\n"

    def _template(self, path: Path) -> str:
        """Return the section of a template: heading, first line, verdict and board."""
        about = path.read_text(encoding="utf-8").splitlines()[0].removeprefix("#").strip()
        spec, name = f"templates/{path.name}", path.stem.replace("_", "-")
        said = self._ran(f"sitscad check --hints none {spec}", int(path.stem in REFUSED)).splitlines(keepends=True)
        told = "".join(line for line in said if line.startswith(("signal:", "ok", "not ok")))
        self._ran(f"sitscad build --only gerber --force -o gallery {spec}")
        picture = self.page.parent / "pictures" / f"{name}-body.svg"
        self.written[picture] = (self.folder / "gallery" / name / "fpc" / picture.name).read_bytes()
        board = f"![The board of {path.stem}](pictures/{picture.name})"
        return f"\n## {path.stem}\n\n{about}\n\n```text\n{told}```\n\n{board}\n"


COLUMNS, WIDTH, HEIGHT, WORDS = 4, 300, 240, 34
"""Boards in a row of the gallery, size of each, and height of its name below."""


def gallery(pictures: dict[Path, bytes]) -> bytes:
    """Return one picture of all boards, each scaled to its cell."""
    rooms = []
    for number, (path, content) in enumerate(sorted(pictures.items())):
        # the board without its legend, to a whole unit of 1200: finer than it is shown here
        whole = content.decode("utf-8")
        drawn = whole[whole.index("<svg x='0' y='0'") : whole.index("</svg>")] + "</svg>"
        drawn = re.sub(r"-?\d+\.\d+", lambda found: f"{float(found[0]):.0f}", drawn)
        x, y = WIDTH * (number % COLUMNS), (HEIGHT + WORDS) * (number // COLUMNS)
        room = f"<svg x='{x + 8}' y='{y + 8}' width='{WIDTH - 16}' height='{HEIGHT - 16}'"
        drawn = re.sub(r"<svg x='0' y='0' width='\d+' height='\d+'", room, drawn, count=1)
        name = path.stem.removesuffix("-body")
        rooms.append(f"{drawn}\n<text x='{x + WIDTH // 2}' y='{y + HEIGHT + 14}'>{name}</text>\n")
    size = WIDTH * COLUMNS, (HEIGHT + WORDS) * -(-len(rooms) // COLUMNS)
    head = f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {size[0]} {size[1]}' role='img'>\n"
    paper = f"<title>the boards of all templates</title>\n<rect width='{size[0]}' height='{size[1]}' fill='#ffffff'/>\n"
    words = "<g font-family='Helvetica, Arial, sans-serif' font-size='18' text-anchor='middle' "
    words += "stroke-linecap='round' stroke-linejoin='round'>\n"
    return "".join((head, paper, words, *rooms, "</g>\n</svg>\n")).encode()


def made(name: str) -> dict[Path, bytes]:
    """Return a page and its pictures with new output, by path.

    Raises ValueError if the exit code of a command differs from the page.
    """
    with tempfile.TemporaryDirectory() as folder:
        return Making(PAGES[name], Path(folder)).whole()


def stale(name: str) -> list[str]:
    """Return the names of the files of a page that differ from the program's present output."""
    return [path.name for path, data in made(name).items() if not path.is_file() or path.read_bytes() != data]


if __name__ == "__main__":
    for name in sys.argv[1:] or PAGES:
        for path, data in made(name).items():
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(data)
