"""Handing out the example specs that come with sitscad."""

from __future__ import annotations

import difflib
import re
from pathlib import Path

from sitscad.package.folder import PackageError, replace_file, write_file
from sitscad.spec import templates
from sitscad.spec.sensor import json_schema

LONGEST_NAME = 64
"""Characters of a sensor's name at most."""

DEFAULT_TEMPLATE = "grasper_4layer"


def list_templates() -> dict[str, str]:
    """Every template's name with its one-line description: the first comment line of the file."""
    return {name: _description(templates.read(name)) for name in templates.names()}


def write_template(name: str = DEFAULT_TEMPLATE, path: str | Path | None = None, force: bool = False) -> Path:
    """Write a template as a new spec and return its path (``NAME.yaml`` in the working directory by default).

    Hyphens and underscores in `name` count as equal. A file of another name gives the sensor its own, as far as file
    names may hold it.

    Raises
    ------
    PackageError
        for an unknown template, an existing file (unless `force`), or a file that cannot be written.
    """
    found = _find(name)
    target = Path(f"{found}.yaml" if path is None else path)
    text = templates.read(found)
    if target.stem != found and (own := re.sub(r"[^A-Za-z0-9]+", "-", target.stem).strip("-")[:LONGEST_NAME]):
        text = re.sub(r"(?m)^name: \S+", f"name: {own}", text, count=1)
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
"""What the header of every template calls the schema, for editors: it is looked for beside the spec."""


def write_schema(folder: str | Path) -> Path | None:
    """Write the schema that templates name into a folder; None where such a file is there already.

    Raises `PackageError` where it cannot be written.
    """
    import json

    target = Path(folder) / SCHEMA_FILE
    if target.is_symlink() or target.exists():
        return None
    write_file(target, (json.dumps(json_schema(), indent=1) + "\n").encode("ascii"))
    return target


def _find(name: str) -> str:
    """The template that is meant, or a `PackageError` with the nearest name."""
    names = templates.names()
    wanted = name.lower().removesuffix(".yaml").removesuffix(".yml").replace("-", "_")
    if wanted in names:
        return wanted
    near = difflib.get_close_matches(wanted, names, n=1)
    meant = f" Did you mean {near[0]}?" if near else ""
    raise PackageError(f"There is no template {name!r}.{meant} There are: {', '.join(names)}.")


def _description(text: str) -> str:
    comments = (line.strip("# ") for line in text.splitlines() if line.startswith("#"))
    return next((comment for comment in comments if comment), "")
