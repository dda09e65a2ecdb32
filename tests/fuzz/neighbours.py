"""Specs near the templates: every number moved at random by up to 30 %, choices exchanged for others of their lists.

    python tests/fuzz/neighbours.py [--variants N] [--first N] [--seconds S] [--template NAME] [--verbose]
        [--depth check|build|verify|rebuild] [--only STAGE...]

checks N variants of the templates, each in a process of its own, builds those that pass with all stages, verifies the
packages, and compares them with what their specs make once more. It prints every fault with the variant's number, and
at the end how many were refused, passed and failed. The rule under test: a spec that `check` passes builds, and its
package verifies. The depth is where a variant ends; no variant begins after S CPU seconds.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import multiprocessing
import os
import random
import re
import resource
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

from ruamel.yaml import YAML

import sitscad
from sitscad.files.writer import STAGES
from sitscad.spec import templates

FARTHEST = 0.3
"""Largest relative change of a number."""
SHARES = (0.1, 0.3, 1.0)
"""Shares of the numbers that are moved in one variant; each of them, and each largest change, is as likely."""
PARTS = {"circle": 8, "square": 4, "rectangle": 4, "hexagon": 6, "octagon": 8, "racetrack": 2}
"""What a turn of a coil is moved in."""
QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(\s*[^\d\s].*)?")
DEPTHS = ("check", "build", "verify", "rebuild")
PASSED, REFUSED = "passed", "refused"

Place = tuple[Any, Any]
"""A mapping or list, and the key or index of one of its values."""


def variant(seed: object, template: str) -> str:
    """The text of a variant of a template, with the template's comments."""
    pick = random.Random(f"{template} {seed}")
    yaml = YAML()
    yaml.width = 10_000
    document = yaml.load(templates.read(template))
    document["name"] = f"neighbour-{seed}".replace(" ", "-")
    share, farthest = pick.choice(SHARES), FARTHEST * pick.choice((0.1, 0.3, 1.0))
    numbers, choices = _places(document)
    moved = [place for place in numbers if pick.random() < share] or [pick.choice(numbers)]
    for (holder, key), is_whole in moved:
        factor = math.exp(pick.uniform(-1.0, 1.0) * math.log1p(farthest))
        parts = PARTS[document["coil"]["shape"]] if key == "turns" else int(is_whole)
        holder[key] = _moved(holder[key], factor, parts)
    for (holder, key), others in pick.sample(choices, min(len(choices), pick.choice((0, 0, 1, 2)))):
        holder[key] = pick.choice(others)
    text = io.StringIO()
    yaml.dump(document, text)
    return text.getvalue()


def _places(document: Any) -> tuple[list[tuple[Place, bool]], list[tuple[Place, list[str]]]]:
    """Places of all numbers, each with whether it is whole, and of all choices with the other values of their lists."""
    numbers: list[tuple[Place, bool]] = []
    choices: list[tuple[Place, list[str]]] = []

    def walk(holder: Any, schema: dict[str, Any]) -> None:
        for key in holder if isinstance(holder, dict) else range(len(holder)):
            value, below = holder[key], _below(schema, key)
            if isinstance(value, (dict, list)):
                walk(value, below)
            elif others := [each for each in _listed(below) if each != value]:
                choices.append(((holder, key), others))
            elif key not in ("sitscad", "name") and QUANTITY.fullmatch(str(value)):
                is_whole = any(each.get("type") == "integer" for each in _alternatives(below))
                numbers.append(((holder, key), is_whole))

    walk(document, SCHEMA)
    return numbers, choices


SCHEMA = json.loads(json.dumps(sitscad.json_schema()))


def _alternatives(schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """A schema and all that it refers to or allows instead."""
    yield schema
    if "$ref" in schema:
        yield from _alternatives(SCHEMA["$defs"][schema["$ref"].rpartition("/")[2]])
    for each in schema.get("anyOf", ()):
        yield from _alternatives(each)


def _below(schema: dict[str, Any], key: Any) -> dict[str, Any]:
    """The schema of a key's value or of a list's items."""
    result = [each["properties"][key] for each in _alternatives(schema) if key in each.get("properties", {})]
    result += [each["items"] for each in _alternatives(schema) if isinstance(key, int) and "items" in each]
    return {"anyOf": result}


def _listed(schema: dict[str, Any]) -> list[str]:
    """The values that a schema lists."""
    return [value for each in _alternatives(schema) for value in each.get("enum", ())]


def _moved(value: Any, factor: float, parts: int) -> Any:
    """A number times a factor: to three digits, or the nearest positive multiple of 1/parts unless that is 0."""
    number, unit = QUANTITY.fullmatch(str(value)).groups()
    if parts:
        count = max(1, round(float(number) * factor * parts))
        return count // parts if count % parts == 0 else count / parts
    moved = float(f"{float(number) * factor:.3g}")
    return moved if unit is None else f"{moved:g}{unit}"


def checked(text: str, hints: str = "decisive") -> str:
    """Whether a spec passes its check."""
    try:
        spec = sitscad.load_text(text, "neighbour.yaml")
    except sitscad.SpecError as error:
        assert error.findings, "refused without a finding"
        return REFUSED
    return PASSED if sitscad.check(spec, hints=hints).ok else REFUSED


def built(text: str, folder: str, only: Sequence[str] | None = None) -> str:
    """Check a spec and build all of it, or some stages; `PASSED`, `REFUSED` by the check, or what stopped it later."""
    try:
        spec = sitscad.load_text(text, "neighbour.yaml")
    except sitscad.SpecError as error:
        assert error.findings, "refused without a finding"
        return REFUSED
    lines: list[tuple[str, str]] = []
    result = sitscad.build(spec, folder, only, progress=lambda stage, outcome, _: lines.append((stage, outcome)))
    if result.written:
        return PASSED
    errors = [finding for finding in result.checked.findings if finding.severity == "error"]
    return REFUSED if lines[-1] == ("check", "stopped") else f"refused after its check: {errors}"


def verified(folder: str, rebuild: bool) -> str:
    """Verify the one package of a folder, built again or not; `PASSED`, or what differs."""
    (package,) = Path(folder).iterdir()
    return "; ".join(sitscad.verify(package, rebuild=rebuild).differences) or PASSED


def alone(work: Any, *values: Any) -> str:
    """What work ends in, done in a process of its own; an exception is told with its place."""
    received, sent = multiprocessing.Pipe(duplex=False)
    process = CONTEXT.Process(target=_tell, args=(sent, work, *values))
    process.start()
    sent.close()
    try:
        outcome = received.recv()
    except EOFError:
        outcome = "the process died"
    process.join()
    return outcome


LOADED_ONCE = ("build123d", "cadquery", "ezdxf", "gerbonara", "manifold3d", "matplotlib.figure", "scipy.spatial",
               "shapely", "sitscad.checks.judging", "sitscad.package.stages", "trimesh")
"""What every variant's process needs and takes long to load."""

CONTEXT = multiprocessing.get_context("fork")


def _tell(sent: Any, work: Any, *values: Any) -> None:
    try:
        sent.send(work(*values))
    except BaseException as error:
        places = [f"{Path(each.filename).name}:{each.lineno}" for each in traceback.extract_tb(error.__traceback__)]
        sent.send(f"{type(error).__name__}: {error} ({' '.join(places[-4:])})")


def _spent() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def judged(text: str, folder: str, depth: str, only: Sequence[str] | None) -> tuple[str, str]:
    """How far a variant got (one of `DEPTHS`, at most `depth`), and `PASSED`, `REFUSED` by its check, or a fault."""
    outcome = alone(checked, text) if depth == "check" else alone(built, text, folder, only)
    if depth in ("check", "build") or outcome != PASSED:
        return "check" if outcome == REFUSED else depth, outcome
    return depth, alone(verified, folder, depth == "rebuild")


def main() -> int:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--variants", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=math.inf)
    parser.add_argument("--depth", choices=DEPTHS, default=DEPTHS[-1])
    parser.add_argument("--only", choices=STAGES, nargs="+")
    parser.add_argument("--verbose", action="store_true")
    parser.add_argument("--template", choices=templates.names())
    request = parser.parse_args()
    os.environ["SITSCAD_CACHE"] = ""
    for package in LOADED_ONCE:
        import_module(package)
    ends: Counter[str] = Counter()
    names = [request.template] if request.template else templates.names()
    for seed in range(request.first, request.first + request.variants):
        if _spent() > request.seconds:
            break
        name = names[seed % len(names)]
        text = variant(seed, name)
        before = _spent()
        with tempfile.TemporaryDirectory() as folder:
            stage, outcome = judged(text, folder, request.depth, request.only)
        ends[outcome if outcome in (PASSED, REFUSED) else "fault"] += 1
        if request.verbose or outcome not in (PASSED, REFUSED):
            print(f"{seed} ({name}, {_spent() - before:.0f} s), {stage}: {outcome}", flush=True)
    print(f"{ends.total()} variants, {ends[REFUSED]} refused, {ends[PASSED]} passed, {ends['fault']} faults, in "
          f"{_spent():.0f} CPU seconds")
    return 1 if ends["fault"] else 0


if __name__ == "__main__":
    sys.exit(main())
