"""The skin's mould: its cup holds the film's own solid, leans so that it comes out, and goes on the base one way."""

from __future__ import annotations

import math
from dataclasses import replace

import handmade
import pytest
from solid_pairs import interferences
from tolerance import approx

from sitscad.assembly.places.bodies import top_height
from sitscad.assembly.places.seating import process_clearance
from sitscad.assembly.solids.pieces import encapsulation
from sitscad.assembly.solids.solid import manifold, tessellate
from sitscad.assembly.solids.tooling import DRAFT, PINS, SPILL, is_cast, jig, skin_mould, skin_silicone
from sitscad.spec.materials import Encapsulation

pytestmark = pytest.mark.cad

FILM = 0.4e-3
LAYOUT = handmade.jaw_sensor(encapsulation=Encapsulation(handmade.PDMS, FILM))


def cup():
    """As it lies on the base."""
    import build123d as bd

    result = skin_mould(LAYOUT)
    return replace(result, shape=result.shape.rotate(bd.Axis.X, 180.0))


def hollow(height):
    """The cavity's area (mm2) at a height (mm), the holes of the pins left out."""
    body, room = manifold(tessellate(cup())), 1e3 * process_clearance(LAYOUT.spec.mount)
    pins = sum(math.pi * (0.5e3 * size + room) ** 2 for size in PINS)
    return body.slice(1e3 * top_height(LAYOUT.spec) + 1.0).area() - body.slice(height).area() - pins


@pytest.mark.slow
def test_film_fills_cup_at_nominal_upper_size():
    assert interferences((cup(), encapsulation(LAYOUT))) == ()
    side, corner = 4.0 + 2e3 * FILM, 1e3 * FILM
    at_top = hollow(1e3 * top_height(LAYOUT.spec) - 1e-3)
    assert at_top == approx(side**2 - (4 - math.pi) * corner**2, abs=0.02)


def test_cup_walls_lean_by_draft():
    high, low = hollow(1.5), hollow(0.8)
    wider = 2.0 * 0.7 * math.tan(DRAFT)
    assert math.sqrt(low) - math.sqrt(high) == approx(wider, rel=0.05)


@pytest.mark.slow
def test_cup_fits_jig_base_in_single_orientation():
    import build123d as bd

    base = next(solid for solid in jig(LAYOUT) if solid.name == "jig-base")
    assert interferences((base, cup())) == ()
    box = base.shape.bounding_box()
    middle = bd.Axis(((box.min.X + box.max.X) / 2, (box.min.Y + box.max.Y) / 2, 0), (0, 0, 1))
    assert interferences((base, replace(cup(), shape=cup().shape.rotate(middle, 180.0)))) != ()


def test_poured_volume_is_film_and_draft():
    film, result = encapsulation(LAYOUT), skin_silicone(LAYOUT)
    assert result.mixed == approx(SPILL * result.pad, rel=1e-6)
    assert 0.9 * film.volume < result.pad < 1.3 * film.volume


def test_thin_film_is_not_cast():
    thin = handmade.jaw_sensor(encapsulation=Encapsulation(handmade.PDMS, 0.1e-3))
    assert not is_cast(thin) and skin_mould(thin) is None and skin_silicone(thin) is None
    assert not is_cast(handmade.layout("bare"))
    contacts = handmade.with_solder_pads(LAYOUT)
    assert not is_cast(contacts)
