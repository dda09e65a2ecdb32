"""What a page shows is made when the page is: specs, commands with their output, programs, pictures, templates, rules.

All pages share one scratch folder a build, in which ``templates`` and ``docs`` lead into the repository. A command that
ends with another exit code than the page says ends the build.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[1]
REFUSED = {"grasper_3p5mm"}
"""Templates that are there to be refused."""
LONGEST = 600.0
"""Seconds after which a command has gone astray."""


def scratch(app: Sphinx) -> Path:
    """The folder in which commands run: one a build, made anew."""
    return Path(app.doctreedir) / "scratch"


def prepared(app: Sphinx) -> None:
    """Make the scratch folder."""
    folder = scratch(app)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in ("templates", "docs"):
        (folder / name).symlink_to(ROOT / name)


def output_of(words: list[str], folder: Path, exit_code: int = 0) -> str:
    """What a command of sitscad, or a program in Python, prints in a folder, messages included."""
    python = [sys.executable, "-m", "sitscad"] if words[0] == "sitscad" else [sys.executable]
    environment = {**os.environ, "NO_COLOR": "1", "COLUMNS": "110", "MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)}
    ran = subprocess.run(
        [*python, *words[1:]], cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True, timeout=LONGEST,
    )  # fmt: skip
    if ran.returncode != exit_code:
        raise ExtensionError(f"{shlex.join(words)} ended with {ran.returncode}, not {exit_code}:\n{ran.stdout}")
    return ran.stdout


def literal(text: str, language: str) -> nodes.literal_block:
    """A block of text with its colours."""
    block = nodes.literal_block(text, text)
    block["language"] = language
    return block


class Scratch(SphinxDirective):
    """What all of these share: the scratch folder."""

    @property
    def folder(self) -> Path:
        """Where commands run and files are written."""
        return scratch(self.env.app)

    def picture(self, path: Path, alt: str) -> nodes.image:
        """A picture that lies anywhere, shown as wide as the page."""
        if not path.is_file():
            raise self.error(f"no picture: {path.name}")
        return nodes.image(uri=os.path.relpath(path, self.env.srcdir), alt=alt, width="100%")


class SpecFile(Scratch):
    """Writes its text into the scratch folder under its name, and shows it."""

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        """The text, with the file's name above."""
        text = "\n".join(self.content) + "\n"
        (self.folder / self.arguments[0]).write_text(text, encoding="utf-8")
        caption = nodes.caption("", "", nodes.literal(text=self.arguments[0]))
        return [
            nodes.container("", caption, literal(text, "yaml"), literal_block=True, classes=["literal-block-wrapper"])
        ]


class ShownFile(Scratch):
    """Shows a file of the scratch folder, or the lines of it that match `:lines:`."""

    required_arguments = 1
    option_spec: ClassVar = {"lines": directives.unchanged, "language": directives.unchanged}

    def run(self) -> list[nodes.Node]:
        """The file's text."""
        text = (self.folder / self.arguments[0]).read_text(encoding="utf-8")
        if wanted := self.options.get("lines"):
            text = "".join(line for line in text.splitlines(keepends=True) if re.search(wanted, line))
        return [literal(text, self.options.get("language", "text"))]


class Command(Scratch):
    """Runs the commands of its text, a line each, and shows them with what they print."""

    has_content = True
    option_spec: ClassVar = {
        "exit": directives.nonnegative_int,
        "lines": directives.positive_int,
        "last": directives.positive_int,
    }

    def run(self) -> list[nodes.Node]:
        """The commands and their output, as on a terminal: all of it, the first `:lines:` or the `:last:` ones."""
        shown: list[str] = []
        for line in self.content:
            said = output_of(shlex.split(line), self.folder, self.options.get("exit", 0)).splitlines()
            last = self.options.get("last", 0)
            first = self.options.get("lines", 0 if last else len(said))
            left_out = ["..."] if len(said) > first + last else []
            shown += [f"$ {line}", *said[:first], *left_out, *said[max(first, len(said) - last) :]]
        return [literal("\n".join(shown) + "\n", "console")]


class Program(Scratch):
    """Runs a program of docs/examples and shows its text, what it prints and, with `:picture:`, what it draws."""

    required_arguments = 1
    option_spec: ClassVar = {
        "arguments": directives.unchanged,
        "picture": directives.unchanged,
        "alt": directives.unchanged,
    }

    def run(self) -> list[nodes.Node]:
        """The program's text, output and picture."""
        path = f"docs/examples/{self.arguments[0]}"
        said = output_of(["python", path, *shlex.split(self.options.get("arguments", ""))], self.folder)
        found: list[nodes.Node] = [literal((ROOT / path).read_text(encoding="utf-8"), "python")]
        found += [literal(said, "text")] if said.strip() else []
        if "picture" in self.options:
            found.append(self.picture(self.folder / self.options["picture"], self.options.get("alt", "")))
        return found


class MadePicture(Scratch):
    """A picture out of the scratch folder, with its text below."""

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        """The picture as a figure."""
        words = " ".join(self.content)
        image = self.picture(self.folder / self.arguments[0], words)
        return [nodes.figure("", image, nodes.caption("", words))]


class Templates(Scratch):
    """Every template: its first line, its verdict and signal, its board."""

    def run(self) -> list[nodes.Node]:
        """A section a template."""
        return [node for path in sorted((ROOT / "templates").glob("*.yaml")) for node in self._of(path)]

    def _of(self, path: Path) -> list[nodes.Node]:
        """One template's heading, words and picture."""
        about = path.read_text(encoding="utf-8").splitlines()[0].removeprefix("#").strip()
        refused = path.stem in REFUSED
        spec = f"templates/{path.name}"
        said = output_of(["sitscad", "check", "--hints", "none", spec], self.folder, int(refused)).splitlines()
        told = [line for line in said if line.startswith(("signal:", "ok", "not ok"))]
        output_of(["sitscad", "build", "--only", "gerber", "--force", "-o", "gallery", spec], self.folder)
        package = self.folder / "gallery" / path.stem.replace("_", "-")
        section = nodes.section("", nodes.title(text=path.stem), ids=[nodes.make_id(path.stem)])
        section += nodes.paragraph("", about)
        section += literal("\n".join(told) + "\n", "text")
        section += self.picture(package / "fpc" / f"{package.name}-body.svg", f"the board of {path.stem}")
        return [section]


def with_rules(app: Sphinx, page: str, source: list[str]) -> None:
    """Put the rules, as the command prints them, in the place that a page leaves for them."""
    if "<!-- rules -->" in source[0]:
        told = output_of(["sitscad", "rules", "--format", "markdown"], scratch(app))
        source[0] = source[0].replace("<!-- rules -->", told.partition("\n")[2])


def bare_values(app: Sphinx, what: str, name: str, value: Any, options: Any, signature: str, result: str) -> Any:
    """The heading of a class of values: its fields follow below, and are no arguments that a caller would write."""
    return ("", result) if what in ("class", "exception") and signature else None


DIRECTIVES: dict[str, type[SphinxDirective]] = {
    "spec-file": SpecFile,
    "shown-file": ShownFile,
    "command": Command,
    "example-program": Program,
    "made-picture": MadePicture,
    "templates": Templates,
}


def setup(app: Sphinx) -> dict[str, Any]:
    """Make the directives known."""
    for name, directive in DIRECTIVES.items():
        app.add_directive(name, directive)
    app.connect("builder-inited", prepared)
    app.connect("source-read", with_rules)
    app.connect("autodoc-process-signature", bare_values)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
