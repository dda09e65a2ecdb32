"""What a notebook shows of public values, and what errors say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import sitscad
from sitscad.calibration import calibrate
from sitscad.spec import templates

ROOT = Path(__file__).parents[2]
LONGEST = 220
"""Characters of a line that shows a value."""


@pytest.fixture(scope="module")
def bench():
    return sitscad.Design(sitscad.load_text(templates.read("bench_7mm"), "bench.yaml"))


@pytest.mark.more
@pytest.mark.slow
def test_repr_of_every_result_is_one_short_line(bench):
    spec, layout, checked = bench.spec, bench.layout, sitscad.check(bench.spec, hints="none")
    study = sitscad.Study.load(next((ROOT / "templates" / "studies").glob("*.yaml")))
    values = [
        spec, layout, bench, bench.estimates, *bench.estimates.coils, *bench.estimates.coils[0].states.values(),
        *bench.performance, checked, *checked.findings, sitscad.respond(bench, [[0] * 6]), calibrate(bench),
        calibrate(bench).map, sitscad.measure(spec, ["rp"]), sitscad.sweep(spec, {"coil.turns": [11, 12]}, ["rp"]),
        *sitscad.centre_lines(layout)[:1], *sitscad.current_paths(layout)[:1], *sitscad.areas(layout)[:1],
    ]
    for value in [*values, study]:
        shown = repr(value)
        assert len(shown) <= LONGEST and "\n" not in shown and type(value).__name__ in shown, shown[:300]


@pytest.mark.slow
def test_repr_of_results_names_rules_and_axes(bench):
    checked = sitscad.check(bench.spec, hints="none")
    assert all(item.rule in repr(checked) for item in checked.findings if item.severity is not sitscad.Severity.NOTE)
    assert all(axis in repr(bench.performance[2]) for axis in bench.performance[2].axes)


def test_dir_of_package_lists_public_names():
    assert dir(sitscad) == sorted(sitscad.__all__)


def test_spec_error_text_contains_message_and_hint_of_every_finding():
    with pytest.raises(sitscad.SpecError) as caught:
        sitscad.load_text("sitscad: 1\nname: x\ncoil: {shape: cirle, outer_diameter: 7 mn, turns: 5}\n")
    assert len(caught.value.findings) > 2
    for result in caught.value.findings:
        assert result.message in str(caught.value) and result.hint in str(caught.value)


PLUGIN = """import sitscad

def apply(design):
    value = design.spec.coil
    return [value.nonsense]

RULES = (sitscad.Rule("LAB001", "lab-rule", sitscad.Severity.WARNING, "must", "why", "mend", "source", (), apply),)
"""


@pytest.mark.parametrize(("text", "line"), [
    (PLUGIN, 5),
    ("import sitscad\n\nraise ValueError('x')\n", 3),
    ("import sitscad\nx = (\n", 2),
    ("def f():\n    return g()\ndef g():\n    return 1 / 0\nf()\n", 4),
])
def test_plugin_error_names_line_of_plugin(text, line, tmp_path, bench, monkeypatch):
    from sitscad.checks import judging
    from sitscad.files import writer

    monkeypatch.setattr(judging, "_added", ())
    monkeypatch.setattr(writer, "_marks", (), raising=False)
    path = Path(tmp_path / "own.py")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(sitscad.PluginError, match=rf"line {line}: "):
        sitscad.use_plugin(path)
        sitscad.check(bench.spec, hints="none")


def test_attributes_named_on_library_page_exist(bench):
    """The tables name attributes of a spec and of a layout."""
    page = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
    named = re.findall(r"^\| `(spec|layout)\.([\w.]+)` \|", page, re.MULTILINE)
    assert len(named) > 30
    own = {"spec": sitscad.load_text(templates.read("grasper_4layer")), "layout": bench.layout}
    for owner, names in named:
        value = own[owner]
        for name in names.split("."):
            assert hasattr(value, name), (owner, names)
            value = getattr(value, name)
            if value is None:
                break
