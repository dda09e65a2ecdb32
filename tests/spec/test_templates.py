"""The templates that `sitscad new` hands out."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tolerance import approx

from sitscad.spec import templates


def test_template_list_includes_the_four_first_templates():
    assert {"bench_7mm", "grasper_3p5mm", "grasper_4layer", "single_coil"} <= set(templates.names())


def test_templates_equal_files_of_source_tree():
    root = Path(__file__).parents[2]
    for name in templates.names():
        assert templates.read(name) == (root / "templates" / f"{name}.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["", "../pyproject", "no_such"])
def test_unknown_template_name_raises_key_error(name):
    with pytest.raises(KeyError):
        templates.read(name)


@pytest.mark.parametrize("name", ["grasper_4layer", "grasper_3p5mm"])
def test_resistances_in_template_comments_match_estimates(name):
    """The worse coil's Rp in the three states, to the digit shown."""
    import sitscad

    text = " ".join(line.strip("# ") for line in templates.read(name).splitlines() if line.startswith("#"))
    words = re.search(r"([\d.]+) kohm free, ([\d.]+) kohm at rest and ([\d.]+) kohm pressed", text).groups()
    coils = sitscad.estimate(sitscad.lay_out(sitscad.load_text(templates.read(name)))).coils
    for word, state in zip(words, ("free", "rest", "pressed"), strict=True):
        worst = min(coil.states[state].parallel_resistance for coil in coils)
        assert float(word) * 1e3 == approx(worst, rel=0.06), state


INHERENT = {
    "bench_7mm": {"SIT103"},
    "bench_steady": set(),
    "fingertip_cell": {"SIT409", "SIT414"},
    "fingertip_foil": set(),
    "grasper_3p5mm": {"SIT103", "SIT203", "SIT204", "SIT217", "SIT221", "SIT303", "SIT304", "SIT308", "SIT310"},
    "grasper_4layer": {"SIT103", "SIT221", "SIT308"},
    "grasper_steady": {"SIT103", "SIT221", "SIT224", "SIT308"},
    "jaw_5x20": {"SIT308"},
    "racetrack_jaw": {"SIT103", "SIT308"},
    "robotic_jaw_12mm": {"SIT221", "SIT308"},
    "round_button_12mm": set(),
    "single_coil": set(),
    "skin_grid_3x3": set(),
    "skin_strip_6": set(),
    "square_bench": set(),
    "three_axis_grid": {"SIT103"},
    "three_axis_pad": set(),
    "three_axis_triangle": {"SIT103"},
}
"""What warns of each template, or refuses it: a first one alone and a first one mounted are clean."""


@pytest.mark.few(4)
@pytest.mark.slow
@pytest.mark.parametrize("name", templates.names())
def test_template_warnings_are_expected_and_named_in_its_comments(name):
    import sitscad

    spec = sitscad.load_text(templates.read(name))
    result = sitscad.check(spec, hints="none")
    message = {f.rule for f in result.findings if f.severity is not sitscad.Severity.NOTE}
    assert message == INHERENT[name]
    if name != "grasper_3p5mm":  # that one says at its head that it is refused, and why
        assert all(rule in templates.read(name) for rule in message)
    assert name == "grasper_3p5mm" or result.ok


@pytest.mark.more
@pytest.mark.slow
def test_robotic_jaw_template_passes_check_for_fabricators_in_its_comments():
    """As its comments say: a house with a rule for coils waives nothing, and OSH Park has a stack-up of its own."""
    import sitscad

    spec = sitscad.load_text(templates.read("robotic_jaw_12mm"))
    own = {"fpc.rules": "osh-park-flex", "fpc.stackup": "flex-2l-osh-park", "fpc.tail.connector": "solder-pads"}
    for changes in ({"fpc.rules": "hkgalaxy"}, {"fpc.rules": "jselectronic"}, {"fpc.rules": "shipco"}, own):
        result = sitscad.check(spec.replace(changes), hints="none")
        graver = {f.rule for f in result.findings if f.severity is not sitscad.Severity.NOTE}
        assert result.ok and graver <= ({"SIT103", "SIT221"} if changes is own else {"SIT221"}), changes
    assert {reached.axis for reached in result.reached} == {"normal", "shear along x"}
