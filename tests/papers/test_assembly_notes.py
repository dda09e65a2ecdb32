"""How the sensor is put together, for a reader who has the package alone."""

from __future__ import annotations

import re
from dataclasses import replace

import handmade
import pytest

import sitscad
from sitscad.papers.assembly_notes import WIDTH, render, text
from sitscad.scene.fit import closed_section
from sitscad.spec import templates

GRASPER = sitscad.lay_out(sitscad.load_text(templates.read("grasper_4layer"), "t.yaml"))


def test_steps_are_numbered_and_fit_a_page():
    lines = text(GRASPER).splitlines()
    numbers = [int(found[1]) for line in lines if (found := re.match(r" ?(\d+)\. ", line))]
    assert numbers == list(range(1, len(numbers) + 1)) and len(numbers) == 10
    assert max(map(len, lines)) <= WIDTH


def test_every_layer_is_listed_and_they_add_up_to_the_pair():
    rows = re.findall(r"^  ([a-z -]+?) +([\d.]+) \+-([\d.]+) mm$", text(GRASPER), re.M)
    assert len(rows) == 13
    assert sum(float(size) for _, size, _ in rows) == pytest.approx(closed_section(GRASPER).height * 1e3, abs=1e-6)


def test_every_piece_of_the_jig_that_is_named_is_made():
    from sitscad.parts import aids

    named = set(re.findall(r"(jig-[a-z-]+|mould-[a-z]+)", text(GRASPER).replace("\n    ", " ")))
    assert named <= {solid.name for solid in aids(GRASPER)}


test_every_piece_of_the_jig_that_is_named_is_made = pytest.mark.cad(test_every_piece_of_the_jig_that_is_named_is_made)


def test_a_bench_plate_has_no_jaw_to_glue_into():
    bench = sitscad.lay_out(sitscad.load_text(templates.read("bench_7mm"), "t.yaml"))
    said = text(bench)
    assert "M2 screws" in said and "port" not in said and "jaw" not in " ".join(said.split()).replace("in the jaw.", "")


def test_without_a_mount_there_is_no_page_and_without_a_pad_no_mould():
    bare = handmade.bare()
    assert render(bare) == {}
    none = replace(GRASPER, spec=replace(GRASPER.spec, elastomer=None))
    assert "mould-" not in text(none) and "jig-elastomer" not in text(none)
