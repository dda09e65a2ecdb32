"""The Gerber job file held against the files beside it: which file is which layer, and in which order they lie."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from sitscad.extraction.artwork import ExtractionError, file_functions

UNLISTED = "Drillmap"
"""What a job file does not list: a drawing."""


def compare_job(directory: Path) -> Iterator[str]:
    """Every difference between what the one job file of a directory says of its files, what these say of themselves,
    and the order in which the stack-up names them, in words; nothing where there is no job file.

    Raises ExtractionError where the job file cannot be read.
    """
    functions = {path.name: ",".join(fields) for path, fields in sorted(file_functions(directory))}
    for path in sorted(directory.glob("*.gbrjob")):
        listed, copper = _read(path)
        for name in sorted({*listed, *functions}):
            said, own = listed.get(name), functions.get(name)
            if own is None:
                yield f"{path.name} lists {name}, which is not there or does not say what it is"
            elif said != own and own != UNLISTED:
                yield f"{name} says that it is {own}, and {path.name} {f'that it is {said}' if said else 'not'}"
        for number, layer in enumerate(copper, start=1):
            for name, own in functions.items():
                if name.endswith(f"-{layer}.gbr") and not own.startswith(f"Copper,L{number},"):
                    yield f"{name} says that it is {own}, and is copper layer {number} of the stack-up in {path.name}"
        own_layers = sum(own.startswith("Copper,") for own in functions.values())
        if own_layers != len(copper):
            yield f"{path.name} has {len(copper)} copper layers in its stack-up, and there are files of {own_layers}"


def _read(path: Path) -> tuple[Mapping[str, str], list[str]]:
    """The file functions that a job file lists by file names, and the copper layers of its stack-up from the top."""
    try:
        document: Any = json.loads(path.read_bytes())
        listed = {str(row["Path"]): str(row["FileFunction"]) for row in document["FilesAttributes"]}
        return listed, [str(row["Name"]) for row in document["MaterialStackup"] if row["Type"] == "Copper"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise ExtractionError(f"{path.name} is no job file: {type(error).__name__}: {error}") from error
