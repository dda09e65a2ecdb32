"""SIT304 to SIT306, SIT310, SIT312 and SIT313: whether pad and target turn force into signal."""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.checks.fit import ROUNDING, pad_of
from sitscad.checks.rules import Complaint, Rule, Subject, Undecided, Verdict
from sitscad.finding import Severity
from sitscad.mechanics import elastomer
from sitscad.spec.sensor import ElastomerPad
from sitscad.units import show

MU_0 = 4e-7 * math.pi

STRAIN_ERROR = 0.5
TARGET_LENGTH_TOLERANCE = 0.2
MAGNETIC = 10.0
"""Relative permeability, and skin depths over thickness, from which on a target is a magnet and no conductor."""

SLENDERNESS = 0.25
"""Thickness over width of the 8 x 8 x 2 mm bench pad (Jones, thesis, Leeds), whose target was seen to stay level."""


def elastomer_strain(subject: Subject) -> Iterator[Verdict]:
    """How far the required force compresses the pad, with the spread of its modulus."""
    pad, force = pad_of(subject), subject.spec.requirements.normal_force
    assert force is not None
    material = pad.material
    stiff, soft = 1.0 + material.shear_modulus_sigma, _softest(material.shear_modulus_sigma)
    nominal, least, most = (_compressed(pad, force, factor) for factor in (1.0, stiff, soft))
    if most.strain <= elastomer.VALID_STRAIN:
        return
    is_error = nominal.strain > STRAIN_ERROR
    limit = STRAIN_ERROR if is_error else elastomer.VALID_STRAIN
    judged = nominal.strain if is_error else most.strain
    yield Complaint(
        f"{show(force, 'N')} compress the {show(pad.thickness, 'm')} {material.name} pad by "
        f"{100.0 * nominal.strain:.0f} % ({100.0 * least.strain:.0f} to {100.0 * most.strain:.0f} % with the modulus "
        f"{show(material.shear_modulus, 'Pa', 3)} +- {100.0 * material.shear_modulus_sigma:.0f} %), down to "
        f"{show(nominal.gap, 'm', 3)}; shape factor {nominal.shape_factor:.2f}. "
        f"{'That' if is_error else 'The softest case'}, {100.0 * judged:.1f} %, is more than {100.0 * limit:.0f} %"
        + ("" if nominal.valid else f"; beyond {100.0 * elastomer.VALID_STRAIN:.0f} % the formula is extrapolated"),
        f"{_stiffer(pad, force)}a larger or thinner pad gives way less. "
        "Measure a coupon: data sheets differ from measurements by 1.1 to 3.7 times",
        "elastomer.material",
        judged,
        limit,
        None,
        Severity.ERROR if is_error else Severity.WARNING,
    )


def target_thickness(subject: Subject) -> Iterator[Verdict]:
    """The target in skin depths at the lowest sensor frequency."""
    target = subject.spec.target
    assert target is not None
    frequencies = [
        state.frequency
        for coil in subject.estimates.coils
        for state in coil.states.values()
        if state.frequency is not None and math.isfinite(state.frequency) and state.frequency > 0.0
    ]
    if not frequencies:
        yield Undecided("no sensor frequency was estimated")
        return
    if target.material.conductivity <= 0.0:
        yield Complaint(
            f"the target's material {target.material.name} does not conduct: no eddy currents flow in it",
            "take a metal: copper or aluminium; what senses is the field that its eddy currents push back",
            "target.material",
        )
        return
    if target.material.relative_permeability >= MAGNETIC:
        deep = skin_depth(min(frequencies), target.material.conductivity, target.material.relative_permeability)
        if deep > MAGNETIC * target.thickness:
            yield Undecided(
                f"skin depths say nothing about {target.material.name}: it hardly conducts, and senses by drawing the "
                "field in; its permeability and thickness are in the estimate"
            )
            return
    depth = skin_depth(min(frequencies), target.material.conductivity, target.material.relative_permeability)
    ratio = target.thickness / depth
    if ratio < 3.0:
        is_error = ratio < 1.0
        yield Complaint(
            f"the target is {show(target.thickness, 'm', 3)} thick, {ratio:.2g} skin depths of {target.material.name} "
            f"at {show(min(frequencies), 'Hz', 3)}: the field goes through it",
            f"take {show(3.0 * depth, 'm', 3)} or more (3 skin depths stop 95 %), or a higher frequency",
            "target.thickness",
            ratio,
            1.0 if is_error else 3.0,
            "skin depths",
            Severity.ERROR if is_error else Severity.WARNING,
        )


def target_proportions(subject: Subject) -> Iterator[Verdict]:
    """Length as the coils' distance, width at least a coil's."""
    target, coil, array = subject.spec.target, subject.spec.coil, subject.spec.array
    assert target is not None
    is_line = array.pattern == "line" and array.pitch is not None and len(array.placements) > 1
    length, width = target.size
    if is_line and array.pitch and abs(length / array.pitch - 1.0) > TARGET_LENGTH_TOLERANCE:
        yield Complaint(
            f"the target is {show(length, 'm')} long, the coils' centres are {show(array.pitch, 'm')} apart",
            f"a target as long as that distance, {show(array.pitch, 'm')}, gives the most shear signal",
            "target.size",
            length,
            array.pitch,
            "m",
        )
    short = width if is_line else min(length, width)
    needed = coil.size[1] if is_line else coil.outer_diameter
    if short < needed - ROUNDING:
        yield Complaint(
            f"the target is {show(short, 'm')} wide, a coil {show(needed, 'm')}: part of the field passes beside it",
            f"widen it by {show(needed - short, 'm')}",
            "target.size",
            short,
            needed,
            "m",
        )


def target_rotation(subject: Subject) -> Iterator[Verdict]:
    """Thickness over width of the pad: slender pads let the target tilt."""
    pad = pad_of(subject)
    ratio = pad.thickness / min(pad.size)
    if ratio > SLENDERNESS + ROUNDING:
        yield Complaint(
            f"the elastomer is {ratio:.2g} times as thick as wide: the target tilts easily, and tilt reads as shear",
            f"{show(SLENDERNESS * min(pad.size), 'm', 3)} is as slender as the bench pad that stayed level (8 x 8 x "
            "2 mm; Jones, thesis, Leeds); thinner is steadier still",
            "elastomer.thickness",
            ratio,
            SLENDERNESS,
            None,
        )


def elastomer_shear(subject: Subject) -> Iterator[Verdict]:
    """How far the required shear force moves the target, against half the coils' distance."""
    pad, force, pitch = pad_of(subject), subject.spec.requirements.shear_force, subject.spec.array.pitch
    assert force is not None
    if pitch is None:
        yield Undecided("no pitch: the coils have no common distance")
        return
    area = elastomer.loaded_area(*pad.size, pad.shape == "circle")
    travel = force * pad.thickness / (pad.material.shear_modulus * area)
    if travel > pitch / 2.0:
        yield Complaint(
            f"{show(force, 'N')} of shear move the target by about {show(travel, 'm', 2)} "
            f"({travel / pad.thickness:.2g} times the pad's thickness); beyond {show(pitch / 2.0, 'm')} it has passed "
            "a coil's centre and the signal turns back",
            f"a shear modulus of {show(pad.material.shear_modulus * 2.0 * travel / pitch, 'Pa', 2)} or more, a larger "
            "or a thinner pad",
            "elastomer.material",
            travel,
            pitch / 2.0,
            "m",
        )


def target_gap(subject: Subject) -> Iterator[Verdict]:
    """A target needs something soft to lie on: without an elastomer it lies on the board itself."""
    if subject.spec.elastomer is None:
        yield Complaint(
            "the target lies on the board, at gap 0: no elastomer is under it, so no force moves it, and the numbers "
            "at rest are those of metal against the coverlay",
            "add elastomer.thickness (like elastomer: {thickness: 1}): it is the gap between board and target",
            "elastomer.thickness",
            0.0,
            None,
            "m",
        )


def skin_depth(frequency: float, conductivity: float, relative_permeability: float = 1.0) -> float:
    """Depth (m) at which a field has fallen to 1/e: 1 / sqrt(pi f mu sigma); frequency in Hz, conductivity in S/m."""
    return 1.0 / math.sqrt(math.pi * frequency * MU_0 * relative_permeability * conductivity)


def _compressed(pad: ElastomerPad, force: float, factor: float) -> elastomer.Compression:
    return elastomer.compress(
        *pad.size,
        pad.thickness,
        pad.material.shear_modulus * factor,
        pad.material.bulk_modulus,
        force,
        pad.shape == "circle",
    )


def _softest(sigma: float) -> float:
    """The share of its modulus that a material of a relative uncertainty may have in the softest case."""
    return max(0.05, 1.0 - sigma)


def _stiffer(pad: ElastomerPad, force: float) -> str:
    """The shear modulus that keeps even the softest case within the valid strain; nothing where bulk limits it."""
    strain, sigma = elastomer.VALID_STRAIN, pad.material.shear_modulus_sigma
    size = (*pad.size, pad.thickness)
    # Ea is proportional to G until the bulk modulus counts: 1/Ea = 1/(k G) + 1/B, so G = 1 / (k (1/Ea - 1/B)).
    stiffness = force / elastomer.force_for_strain(strain, *size, 1.0, math.inf, pad.shape == "circle")
    slope = elastomer.apparent_modulus(elastomer.shape_factor(*size, pad.shape == "circle"), 1.0)
    left = 1.0 / (stiffness * slope) - 1.0 / pad.material.bulk_modulus
    if left <= 0.0:
        return ""
    wanted = _rounded_up(1.0 / (slope * left) / _softest(sigma))
    known = f", known to +- {100.0 * sigma:.0f} % as here," if sigma > 0.0 else ""
    result = f"keeps the softest case within {100.0 * strain:.0f} %"
    return f"a shear modulus of {show(wanted, 'Pa', 3)} or more{known} {result}; "


def _rounded_up(value: float) -> float:
    """The next value of three digits, never below."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.ceil(value / step) * step


TRANSDUCTION_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT304", "elastomer-strain", Severity.ERROR,
        "The required normal force compresses the elastomer by 30 % at most (a warning beyond, an error beyond 50 %).",
        "Beyond 30 % the bonded-block formula is extrapolated; beyond 50 % the pad has lost its range, creeps, and the "
        "target comes near the coil. A 2 mm Ecoflex 00-30 pad of 4 x 4 mm (miniature of Jones, thesis, Leeds) would "
        "need 57 to 73 % at 4.8 N.",
        "A stiffer or thinner elastomer, or a larger pad.",
        elastomer.SOURCE, ("elastomer", "normal force"), elastomer_strain,
    ),
    Rule(
        "SIT305", "target-thickness", Severity.ERROR,
        "The target is at least 3 skin depths thick (a warning below, an error below 1).",
        "A thinner target lets the field through: less signal, more loss, and a reading that drifts with its "
        "temperature.",
        "A thicker target, a better conductor, or a higher frequency.",
        "TI SNOA957B: 2 to 3 skin depths, 3 stop 95 %; depth = 1 / sqrt(pi f mu sigma)", ("target",), target_thickness,
    ),
    Rule(
        "SIT306", "target-proportions", Severity.WARNING,
        "The target is as long as the coils' distance (within 20 %) and at least as wide as a coil.",
        "Shear falls to less than a third when the target is much longer or shorter; what is narrower than the coil "
        "loses normal signal.",
        "Set target.size to the coils' distance.",
        "thesis of Jones 6.4, 6.5 and tables 6.3, 6.4; TI SNOA957B: target at least the sensor's area", ("target",),
        target_proportions,
    ),
    Rule(
        "SIT310", "target-rotation", Severity.NOTE,
        "The elastomer is not more slender than the bench pad of Jones (thesis, Leeds): a quarter of its width.",
        "A slender pad lets the target tilt; 10 degrees in a scissor jaw gave full-scale shear.",
        "A thinner elastomer: 1 mm instead of 2 mm also gave nearly ten times the normal range.",
        "thesis of Jones 6.5, 7.5.1", ("elastomer", "target"), target_rotation,
    ),
    Rule(
        "SIT312", "elastomer-shear", Severity.WARNING,
        "The required shear force moves the target by less than half the coils' distance.",
        "Beyond that the target's middle has passed a coil's, and L1 - L2 turns back: two forces give one reading.",
        "A stiffer, larger or thinner elastomer.",
        "F = G A gamma, about linear to large strain (Brown, quoted by GlobalSpec); the limit is derived here",
        ("elastomer", "target", "shear force"), elastomer_shear,
    ),
    Rule(
        "SIT313", "target-gap", Severity.WARNING,
        "A target lies on an elastomer, not on the board.",
        "Without a pad the gap is 0 and nothing gives way: the sensor has no signal, and the estimates at rest "
        "describe a target pressed against the coil. A warning only: boards may be ordered before the pad is chosen.",
        "Add elastomer.thickness, or leave the target out until its pad is chosen.",
        "derived here: the gap is the elastomer's thickness", ("target",), target_gap,
    ),
)  # fmt: skip
