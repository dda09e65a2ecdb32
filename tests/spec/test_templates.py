"""The templates that `sitscad new` hands out."""

from __future__ import annotations

from pathlib import Path

import pytest

from sitscad.spec import templates


def test_the_four_templates_are_there():
    assert {"bench_7mm", "grasper_3p5mm", "grasper_4layer", "single_coil"} <= set(templates.names())


def test_a_template_is_the_file_of_the_source_tree():
    root = Path(__file__).parents[2]
    for name in templates.names():
        assert templates.read(name) == (root / "templates" / f"{name}.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["", "../pyproject", "no_such"])
def test_other_names_are_refused(name):
    with pytest.raises(KeyError):
        templates.read(name)
