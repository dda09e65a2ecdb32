"""The two bonded blocks enclose a pad that is loaded over part of its area; the formula is a few percent off each."""

from __future__ import annotations

import math

import pytest
from pad_of_elements import stiffness
from tolerance import approx

from sitscad.kernels.mechanics.elastomer import Face, compress, compress_part

SHEAR, POISSON = 60e3, 0.4998
BULK = 2.0 * SHEAR * (1.0 + POISSON) / (3.0 * (1.0 - 2.0 * POISSON))
SMALL = 1e-6


def block(radius: float, thickness: float) -> float:
    """Stiffness (N/m) of a disc by the formula."""
    modulus = compress(Face(2 * radius, 2 * radius, 1.0), thickness, SHEAR, BULK, 0.0).apparent_modulus
    return modulus * math.pi * radius**2 / thickness


@pytest.mark.few(2)
@pytest.mark.parametrize(
    ("plate", "pad", "thickness"), [(2e-3, 4e-3, 1e-3), (1e-3, 4e-3, 1e-3), (2e-3, 2.2e-3, 1e-3), (2e-3, 4e-3, 2e-3)]
)
def test_pad_strain_bounds_enclose_element_strain(plate, pad, thickness):
    cut, real, whole = (
        stiffness(p, q, thickness, SHEAR, POISSON) for p, q in ((plate, plate), (plate, pad), (pad, pad))
    )
    assert cut < real < whole
    # what the surround adds, in the order of the cases: 76, 116, 18 and 97 %
    assert 1.1 * cut < real < 2.4 * cut
    assert block(plate, thickness) == approx(cut, rel=0.04)
    assert block(pad, thickness) == approx(whole, rel=0.04)
    faces = Face(2 * pad, 2 * pad, True), Face(2 * plate, 2 * plate, True)
    result = compress_part(*faces, thickness, SHEAR, BULK, SMALL)
    strain = SMALL / (real * thickness)
    assert result.least_strain < strain < result.strain
    # one sigma of the doubt is large enough: the real strain lies within it, or a little beyond
    assert result.strain - strain < 1.1 * result.strain_uncertainty


@pytest.mark.slow
def test_pad_stiffness_of_elements_has_converged():
    coarse, fine = (stiffness(2e-3, 4e-3, 1e-3, SHEAR, POISSON, cells) for cells in (10, 16))
    assert coarse == approx(fine, rel=0.02)
    # and know the bar under no lateral constraint in the limit of a slender disc: E A / h
    slender = stiffness(1e-3, 1e-3, 20e-3, SHEAR, POISSON, 16)
    young = 2.0 * SHEAR * (1.0 + POISSON)
    assert slender == approx(young * math.pi * 1e-6 / 20e-3, rel=0.03)
