"""The spec that designs of a study are changes of: a design's values, its spec, and the key that it is kept under."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
from collections.abc import Iterable
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from sitscad.checks import all_rules
from sitscad.opening import opened, policy_for
from sitscad.record import record
from sitscad.spec.format.reading import SpecError, finding_from_text
from sitscad.spec.load import load_text, load_values, put
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.reader import read_yaml
from sitscad.spec.yaml.source import TextError
from sitscad.version import __version__

Changes = tuple[tuple[str, Any], ...]
"""Dotted keys of a spec and the plain values that they take, in their order."""

IGNORES = "# sitscad:"


@record(eq=False)
class Base:
    """A spec by its text and path, and the folder of profiles that its configuration names: small enough to be sent to
    other processes, which read it anew.
    """

    text: str
    path: str
    profiles: str | None = None

    @classmethod
    def of(cls, spec: SensorSpec) -> Base:
        """That of a spec as it was read."""
        return cls(spec.source.text, spec.source.path, policy_for(spec.source.path).profiles)

    @classmethod
    def opened(cls, path: str) -> Base:
        """That of a file; raises `SpecError` where it is none."""
        policy = policy_for(path)
        return cls(opened(path, policy).source.text, path, policy.profiles)

    @cached_property
    def spec(self) -> SensorSpec:
        """The spec as it was read."""
        return load_text(self.text, self.path, self.profiles)

    @cached_property
    def _data(self) -> bytes:  # a tenth of the time of copying it deeply
        return pickle.dumps(dict(read_yaml(self.text.removeprefix("\ufeff")).data))

    def values(self, changes: Changes) -> dict[str, Any]:
        """The plain values of a design; raises `SpecError` where the spec has no place for one."""
        data: dict[str, Any] = pickle.loads(self._data)
        try:
            for key, value in changes:
                put(data, key, value)
        except TextError as error:
            raise SpecError((finding_from_text(error),)) from None
        return data

    def design(self, changes: Changes) -> SensorSpec:
        """The spec of a design: its values, and this spec's text as their source; raises `SpecError`."""
        return load_values(self.values(changes), self.spec.source, self.profiles)

    def written(self, changes: Changes) -> str:
        """The text of a design, comments kept; raises `SpecError`."""
        return self.spec.replace(dict(changes)).source.text

    def key(self, changes: Changes, level: str) -> str:
        """The hash that a design's evaluation is kept under: of its values, of all that it is judged by, of the program
        and of the level.
        """
        try:
            values: Any = self.values(changes)
        except SpecError:
            values = [list(change) for change in changes]
        said = json.dumps([self._judged_by, level, values], sort_keys=True, ensure_ascii=False)
        return hashlib.sha256(said.encode("utf-8", "surrogatepass")).hexdigest()[:32]

    @cached_property
    def _judged_by(self) -> list[Any]:
        """Program, rules, configuration, comments that silence rules, and files that the spec names."""
        own = os.path.basename(self.path)
        files = {name: hashlib.sha256(content).hexdigest() for name, content in self.spec.source.files.items()
                 if name != own}
        comments = [line.strip() for line in self.text.splitlines() if IGNORES in line]
        policy = policy_for(self.path).as_json()
        return [code_version(), [rule.id for rule in all_rules()], policy, comments, files]


@cache
def code_version() -> str:
    """The version of this program, with a hash of its modules and tables: an evaluation is kept for these alone."""
    root, found = Path(__file__).parents[1], hashlib.sha256()
    for path in sorted(_code(root)):
        found.update(path.relative_to(root).as_posix().encode())
        found.update(path.read_bytes())
    return f"{__version__}+{found.hexdigest()[:16]}"


OF_NO_JUDGEMENT = {
    "calibration", "cli", "drawing", "extraction", "formats", "interchange", "package", "papers", "report", "templates",
}
"""Rooms that no verdict and no figure of a design comes from."""

SEARCHING = {"answer.py", "answer_files.py", "answer_text.py", "archive.py", "base.py", "charts.py", "document.py",
             "evaluating.py", "listing.py", "page.py", "running.py", "search.py", "space.py", "study.py",
             "sweep_files.py", "sweeping.py", "__init__.py"}
"""The modules of this room that none comes from, either."""


def _code(root: Path) -> Iterable[Path]:
    for path in root.rglob("*"):
        parts = path.relative_to(root).parts
        is_ours = parts[0] == "study" and parts[-1] in SEARCHING
        if path.is_file() and "__pycache__" not in parts and parts[0] not in OF_NO_JUDGEMENT and not is_ours:
            yield path
