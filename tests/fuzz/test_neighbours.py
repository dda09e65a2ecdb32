"""The templates' neighbourhood in small, another sample for each version: neighbours.py beside this has it in large."""

import random

import pytest
from neighbours import PASSED, REFUSED, built, checked, variant, verified

import sitscad
from sitscad.spec import templates

LARGE = ("skin_grid_3x3", "skin_strip_6", "three_axis_grid", "three_axis_pad", "three_axis_triangle")
"""Templates of many coils, which take half a minute each: neighbours.py has these, too."""
SAMPLED = random.Random(sitscad.__version__).sample([name for name in templates.names() if name not in LARGE], 1)
MOST = 10
"""Variants of one template: the first that passes its check is built. Hints are tried for the very first alone."""


@pytest.mark.slow
@pytest.mark.cad
@pytest.mark.parametrize("template", SAMPLED)
def test_template_variant_is_refused_with_findings_or_builds_and_verifies(template, tmp_path):
    for number in range(MOST):
        text = variant(f"{sitscad.__version__} {number}", template)
        outcome = REFUSED if number and checked(text, "none") == REFUSED else built(text, str(tmp_path))
        assert outcome in (PASSED, REFUSED), f"{template} {number}: {outcome}"
        if outcome == PASSED:
            assert verified(str(tmp_path), rebuild=False) == PASSED
            return


@pytest.mark.parametrize("template", templates.names())
def test_template_variants_are_different_and_repeatable_by_seed(template):
    texts = {variant(seed, template) for seed in range(8)}
    assert len(texts) == 8 and templates.read(template) not in texts
    assert variant(3, template) in texts
