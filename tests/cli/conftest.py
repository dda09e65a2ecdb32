"""Running a command line inside the test's process, as a person would type it."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from sitscad.cli import main

GOOD = """\
# One coil that the converter can drive.
sitscad: 1
name: good-coil
coil:
  shape: circle
  outer_diameter: 10
  turns: 12.5
  layers: 2
  trace_width: 150 um
  trace_spacing: 150 um
"""

WEAK = """\
sitscad: 1
name: weak-coil
coil:
  shape: circle
  outer_diameter: 3.0
  turns: 4.5
  layers: 2
  trace_width: 100 um
  trace_spacing: 100 um
"""

BROKEN = """\
sitscad: 1
name: broken-coil
coil:
  shape: circel
  outer_diameter: 3.5
  turns: 6.5
  trace_width: 100 um
  trace_spacing: 100 um
"""


PAIR = """\
sitscad: 1
name: pair
coil: {shape: circle, outer_diameter: 6, turns: 12.5, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
array: {pattern: line, count: 2, pitch: 7}
fpc: {rules: generic-flex}
target: {shape: square, size: 7, thickness: 0.2, material: copper}
elastomer: {material: ecoflex-00-30, shape: square, size: 7, thickness: 2}
requirements: {normal_force: 2 N}
"""


@dataclass(frozen=True)
class Done:
    """What a command printed and its exit code."""

    code: int
    out: str
    err: str


@pytest.fixture
def run(capsys, monkeypatch, tmp_path):
    """Run `sitscad` with arguments, in an empty folder with three specs: good, weak (electrically), broken."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SITSCAD_TRACEBACK", raising=False)
    for name, text in (("good", GOOD), ("weak", WEAK), ("broken", BROKEN)):
        (tmp_path / f"{name}.yaml").write_text(text)

    def typed(*arguments: str) -> Done:
        with pytest.raises(SystemExit) as left:
            main([str(argument) for argument in arguments])
        printed = capsys.readouterr()
        return Done(left.value.code, printed.out, printed.err)

    return typed


@pytest.fixture
def pair(tmp_path):
    (tmp_path / "pair.yaml").write_text(PAIR)
    return "pair.yaml"
