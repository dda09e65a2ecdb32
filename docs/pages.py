"""Writes what the pages show of the program: outputs of commands, files, pictures, tables of keys, rules, templates.

    python docs/pages.py                     every page anew
    python docs/pages.py tutorial README     these

A page is whole as it is committed, so that it reads on a code host as on the site. What is made in it:

* a ``console`` block whose lines begin with ``$ sitscad`` or ``$ python``: each command is run, its output follows it.
  The page asks for less than all of it, or for another exit code than 0, in the line before:
  ``<!-- exit 1, first 12, last 2 -->`` (lines);
* a block after ``<!-- file NAME -->`` is written under that name, for the commands below it; a block after
  ``<!-- shows PATH -->`` is that file's text;
* a picture after ``<!-- picture PATH -->`` is that file, copied to where the page looks for it;
* ``<!-- run COMMAND -->`` is run and shows nothing;
* everything below the mark in ``library.md``, ``rules.md``, ``templates.md`` and ``spec.md``.

Commands run in an empty folder, one a page, in which ``templates`` and ``docs`` lead into the repository.
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
from sitscad.apps.study.sweeping import shown

ROOT = Path(__file__).parents[1]
PAGES = {path.stem: path for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))}
MARK = "<!-- Below this line the page is written by docs/pages.py. -->\n"
REFUSED = {"grasper_3p5mm"}
"""Templates that are there to be refused."""
LONGEST = 600.0
"""Seconds after which a command has gone astray."""
RUN = r"^<!-- run (?P<run>[^\n]+) -->$"
COMMENT = r"(?:<!-- (?P<told>(?:exit|first|last|file|shows|picture) [^\n]*?) -->\n)?"
FENCE = r"^```(?P<language>\w+)\n(?P<text>.*?)^```$"
PICTURE = r"^!\[[^\]]*\]\((?P<target>[^)]+)\)$"
MADE = re.compile(f"{RUN}|{COMMENT}(?:{FENCE}|{PICTURE})", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Making:
    """One page being made: the folder in which its commands run, and what becomes of files beside it."""

    page: Path
    folder: Path
    written: dict[Path, bytes] = field(default_factory=dict)

    def whole(self) -> dict[Path, bytes]:
        """The page and its pictures, made anew."""
        for name in ("templates", "docs"):
            (self.folder / name).symlink_to(ROOT / name)
        kept, mark, _ = self.page.read_text(encoding="utf-8").partition(MARK)
        text = MADE.sub(self._made, kept) + (f"{mark}\n{self._below()}" if mark else "")
        return {self.page: text.encode(), **self.written}

    def _made(self, found: re.Match[str]) -> str:
        """One block or picture with what it shows now."""
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
        """Each command of a block with the lines of its output that are asked for."""
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
        """What a command of sitscad, or a program, prints as on a terminal of 100 columns, messages included."""
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
        """What follows the mark."""
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
        """One template's five numbers, and the study that searches around it."""
        measures = ("resolution.normal", "inductance", "rp", "amplitude", "fit.spare")
        spec = load(path)
        found = measure(spec, level="full", measures=measures).values
        told = (shown(name, found[name][0], 3) if name in found else "-" for name in measures)
        studies = (f"[{study.stem}](studies.md)" for study in sorted((ROOT / "templates/studies").glob("*.yaml"))
                   if re.search(rf"base: (\.\./)?{path.name}", study.read_text(encoding="utf-8")))
        return f"| [{path.stem}](#{path.stem}) | {' | '.join(told)} | {', '.join(studies) or '-'} |\n"

    def _template(self, path: Path) -> str:
        """One template's heading, first line, verdict and board."""
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
"""Of the gallery: boards in a row, room for each, and for its name below."""


def gallery(pictures: dict[Path, bytes]) -> bytes:
    """All boards in one picture, each as large as its room lets it be."""
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
    """A page and its pictures as they are to be, by path.

    Raises ValueError where a command ends with another exit code than the page says.
    """
    with tempfile.TemporaryDirectory() as folder:
        return Making(PAGES[name], Path(folder)).whole()


def stale(name: str) -> list[str]:
    """What of a page differs from what the program shows now: names of files."""
    return [path.name for path, data in made(name).items() if not path.is_file() or path.read_bytes() != data]


if __name__ == "__main__":
    for name in sys.argv[1:] or PAGES:
        for path, data in made(name).items():
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(data)
