"""Example specs for users: templates, a study of a template, and the JSON schema beside them."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable
from pathlib import Path

from sitscad.basics.finding import Severity
from sitscad.checks.judging import RULES
from sitscad.checks.rules import apply_rule
from sitscad.estimates.design import Design
from sitscad.files.writer import json_bytes
from sitscad.package.folder import PackageError, replace_file, write_file
from sitscad.spec import templates
from sitscad.spec.load import load, rewritten_spec
from sitscad.spec.profiles import installed_rules
from sitscad.spec.reading import SpecError
from sitscad.spec.sensor import SensorSpec, json_schema

LONGEST_NAME = 64
"""Largest number of characters in a sensor's name."""

DEFAULT_TEMPLATE = "grasper_4layer"


def list_templates() -> dict[str, str]:
    """Return a description of each template by its name: the first comment line of its file."""
    descriptions = {}
    for name in templates.names():
        comments = (line.strip("# ") for line in templates.read(name).splitlines() if line.startswith("#"))
        descriptions[name] = next((comment for comment in comments if comment), "")
    return descriptions


def write_template(name: str = DEFAULT_TEMPLATE, path: str | Path | None = None, force: bool = False) -> Path:
    """Write a template as a new spec, and return its path (by default ``NAME.yaml`` in the working directory).

    Hyphens and underscores in `name` are equivalent. If `path` has another file name than the template, the sensor is
    named after the file; other characters than letters and digits become hyphens.

    Raises
    ------
    PackageError
        if the template is unknown, the file exists (unless `force`), or it cannot be written
    """
    template = _find_template(name)
    target = Path(f"{template}.yaml" if path is None else path)
    text = templates.read(template)
    if target.stem != template and (new_name := re.sub(r"[^A-Za-z0-9]+", "-", target.stem).strip("-")[:LONGEST_NAME]):
        text = re.sub(r"(?m)^name: \S+", f"name: {new_name}", text, count=1)
    return _new_file(target, text, force)


RECOMMENDED = "recommended"
"""Name of the fabricator's profile (design rules) that is recommended for first designs."""


def profile_lines(path: Path) -> tuple[str, ...]:
    """Return one or two lines on a spec's fabricator profile: its name and purpose, and the recommended profile.

    The second line states whether the board can be made with the recommended profile. It is omitted if the spec uses
    that profile.
    """
    spec = load(path)
    uses = [("fpc.rules is", spec.fpc.rules)]
    if spec.fpc.rules.name != RECOMMENDED:
        refused = ", ".join(refusing_rules(rewritten_spec(spec, [("fpc.rules", RECOMMENDED)])))
        head = f"this board cannot be made ({refused}) with" if refused else "this board can be made with"
        uses.append((f"{head} fpc.rules", installed_rules(RECOMMENDED)))
    return tuple(f"{head}: {rules.name}" + (f" ({rules.purpose})" if rules.holder("purpose") == rules.name else "")
                 for head, rules in uses)


def refusing_rules(spec: SensorSpec) -> list[str]:
    """Return the ids of the rules on the board (SIT1xx) that report errors in a spec.

    Rules on estimates are not applied.
    """
    design = Design(spec)
    return [rule.id for rule in RULES if rule.id.startswith("SIT1")
            and any(finding.severity is Severity.ERROR for finding in apply_rule(rule, design, Severity.ERROR)[0])]


def write_study(
    of: Callable[[SensorSpec, str], str], name: str = DEFAULT_TEMPLATE, path: str | Path | None = None,
    force: bool = False,
) -> Path:
    """Write a study of a template and return its path (by default ``study.yaml`` in the working directory).

    `of` returns the study's text for the template's spec and its file name. The template is written beside the study,
    unless a file with its name exists.

    Raises
    ------
    PackageError
        for the reasons of `write_template`, or if the template beside the study cannot be read
    """
    target = Path("study.yaml" if path is None else path)
    base = target.parent / f"{_find_template(name)}.yaml"
    if not base.exists():
        write_template(name, base)
    try:
        return _new_file(target, of(load(base), base.name), force)
    except SpecError as error:
        raise PackageError(f"{base} cannot be read: `sitscad check {base}` says why") from error


def _new_file(target: Path, text: str, force: bool) -> Path:
    try:
        if force:
            replace_file(target, text.encode("utf-8"))
        else:
            with open(target, "x", encoding="utf-8", newline="\n") as stream:
                stream.write(text)
    except FileExistsError:
        raise PackageError(f"{target} exists and was not touched; --force writes over it, -o names another") from None
    except OSError as error:
        raise PackageError(f"cannot write {target}: {error.strerror or error}") from error
    return target


SCHEMA_FILE = "sitscad.schema.json"
"""File name of the JSON schema that the header of every template names. Editors look for it beside the spec."""


def write_schema(folder: str | Path) -> Path | None:
    """Write the JSON schema that templates name into a folder, and return its path. None if the file exists already.

    Raises PackageError if it cannot be written.
    """
    target = Path(folder) / SCHEMA_FILE
    if target.is_symlink() or target.exists():
        return None
    write_file(target, json_bytes(json_schema()))
    return target


def _find_template(name: str) -> str:
    """Return the template whose name is `name` apart from case, hyphens and file ending.

    Raises PackageError with the most similar name if there is no such template.
    """
    names = templates.names()
    template = name.lower().removesuffix(".yaml").removesuffix(".yml").replace("-", "_")
    if template in names:
        return template
    near = difflib.get_close_matches(template, names, n=1)
    suggestion = f" Did you mean {near[0]}?" if near else ""
    raise PackageError(f"There is no template {name!r}.{suggestion} There are: {', '.join(names)}.")
