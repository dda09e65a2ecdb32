"""Figures and solids, judged by two ways that know nothing of each other, agree over random sensors."""

from __future__ import annotations

import random
from dataclasses import replace

import handmade
import pytest

from sitscad.parts import PartsError
from sitscad.parts.proof import glued, prove, require_proof
from sitscad.scene.fit import closed_section
from sitscad.spec.sensor import Assembly, Encapsulation, Shield

pytestmark = pytest.mark.cad

GLUED = Assembly(None, 30e-6, 20e-6)


def random_sensor(seed):
    """A sensor in a jaw, some too high or too wide for the port, glued with lines of up to 0.1 mm."""
    chance = random.Random(seed)
    jaw = handmade.jaw(chance.uniform(3e-3, 4.8e-3), chance.uniform(0.9e-3, 1.5e-3), chance.choice((0.0, 0.2e-3)))
    jaw = replace(jaw, hinge=chance.choice((None, 8e-3)), opening=1.0)
    if chance.random() < 0.3:
        jaw = replace(jaw, recess=0.4e-3, pocket=(14e-3, 0.7 * jaw.width))
    standoff = chance.choice((0.7e-3, 1.1e-3, 1.4e-3))
    changes = {
        "mount": handmade.Mount("grasper-pad", jaw, standoff),
        "shield": Shield(handmade.COPPER, 0.1e-3, 0.6e-3) if chance.random() < 0.6 else None,
        "encapsulation": Encapsulation(handmade.PDMS, 0.08e-3) if chance.random() < 0.7 else None,
    }
    layout = handmade.jaw_sensor(**changes)
    layout = handmade.board(layout.spec, body=(9e-3, chance.uniform(3.6e-3, 4.8e-3)))
    return replace(layout, spec=replace(layout.spec, assembly=replace(GLUED, glue_line=chance.uniform(0.0, 1e-4))))


@pytest.mark.parametrize(
    "seed", [0, 1, 93, 118, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(3, 40))]
)
def test_figures_and_solids_agree(seed):
    layout = random_sensor(seed)
    proof, plane = prove(layout), closed_section(layout)
    assert proof.radius == pytest.approx(plane.radius, abs=6e-6)
    assert proof.interferences == ()
    if abs(plane.radius - plane.port_radius) > 6e-6:
        assert proof.fits == plane.fits


def test_glue_leaves_a_gap_of_its_line_between_pieces_and_none_elsewhere():
    layout = handmade.jaw_sensor()
    layout = replace(layout, spec=replace(layout.spec, assembly=GLUED))
    gaps = {(c.first, c.second): c.gap for c in prove(layout).clearances}
    for pair in (("jaw", "mount"), ("mount", "shield"), ("mount-spacer", "board"), ("board", "elastomer"),
                 ("elastomer", "target")):  # fmt: skip
        assert gaps[pair] == pytest.approx(30e-6, abs=1e-9), pair
    assert gaps["encapsulation", "opposing-jaw"] == pytest.approx(0.0, abs=1e-9)


def test_pieces_that_stand_in_each_other_are_refused(monkeypatch):
    import build123d as bd

    layout = handmade.jaw_sensor()

    def sunk(layout, solids):
        return tuple(
            replace(s, shape=s.shape.moved(bd.Location((0, 0, -0.1)))) if s.name == "opposing-jaw" else s
            for s in glued(layout, solids)
        )

    monkeypatch.setattr("sitscad.parts.proof.glued", sunk)
    with pytest.raises(PartsError, match="opposing-jaw stand in each other"):
        require_proof(layout)


def test_without_a_jaw_nothing_is_proven():
    assert prove(handmade.bench_sensor()) is None
