"""SIT304, SIT310, SIT312, SIT313 and SIT327: whether pad and target convert force into signal."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from sitscad.assembly.places.bodies import film_thickness, plates_of
from sitscad.basics.finding import Severity
from sitscad.basics.late import late
from sitscad.basics.record import memo, record
from sitscad.basics.units import show
from sitscad.checks.assembly.fit import require_pad
from sitscad.checks.assembly.plates import plates_lie_on_body
from sitscad.checks.fixes.pads import other_thicknesses, thicker_target
from sitscad.checks.fixes.search import Fix, with_value
from sitscad.checks.rules import ROUNDING, Rule, Verdict, constant_limits, not_checked, rule_of, violation_of
from sitscad.estimates.design import ROOM_TEMPERATURE, Design
from sitscad.estimates.loads.pad import PAD_INSTABILITY, TOO_SOFT, loaded_poses
from sitscad.estimates.loads.pad import TOO_SOFT as LOST
from sitscad.estimates.loads.pressing import loaded_face, pad_surroundings, pressed_pad, rests_on_pad
from sitscad.estimates.loads.working_range import extrapolated_shear_note, validated_shear
from sitscad.kernels.geometry.path import Path
from sitscad.kernels.mechanics import elastomer
from sitscad.kernels.mechanics.elastomer import HELD_SHEAR
from sitscad.spec.circuit import LayerKind
from sitscad.spec.materials import ElastomerMaterial
from sitscad.spec.presets import elastomer as elastomer_preset
from sitscad.spec.presets import names
from sitscad.spec.sensor import SensorSpec

# loads numpy.polynomial (3 ms)
plate_deflection = late("sitscad.kernels.mechanics.plate_bending", "plate_deflection")
rigidity = late("sitscad.kernels.mechanics.plate_bending", "rigidity")

STRAIN_ERROR = 0.5
LOADED = 0.99
"""Ratio of a pad's loaded area to its whole area, above which the pad counts as fully loaded."""

LEAST_MODULUS_CHANGE = 0.05
"""Relative change of the pad's modulus between 20 degC and the temperature of use, below which there is no finding.

It is smaller than the uncertainty of the modulus itself.
"""

SLENDERNESS = 0.25
"""Ratio of a pad's thickness to its width, above which there is a finding.

The 8 x 8 x 2 mm bench pad has this ratio, and its target stayed level (Jones, thesis, Leeds).
"""

THICKNESS_GRAIN = 50e-6
"""Step (m) between the thicknesses that are tried for a pad that buckles sideways."""


def elastomer_strain(design: Design) -> Iterator[Verdict]:
    """Yield findings if the required normal force compresses the pad beyond the valid range of its force law.

    The compression is computed with the nominal modulus, and with a modulus one standard deviation lower. A further
    finding is on the compression at the temperature of use.
    """
    pad, force = require_pad(design.spec.elastomer), design.spec.requirements.normal_force
    assert force is not None
    if not rests_on_pad(design.spec):
        yield not_checked("beside-pad")
        return
    rubber, sigma, valid = pad.material, pad.material.shear_modulus_sigma, elastomer.VALID_STRAIN
    nominal, least, most = (pressed_pad(design.spec, modulus=factor)
                            for factor in (1.0, 1.0 + sigma, _modulus_lower_bound(sigma)))
    yield from _strain_in_use_findings(design.spec, force, nominal)
    if most.strain <= valid:
        return
    certain = nominal.strain
    if nominal.strain_uncertainty:
        # material around the loaded part of a pad makes it stiffer by at most this much, and no pad is compressed
        # less than if all of it is loaded
        helped = pressed_pad(design.spec, modulus=1.0 + constant_limits()["surround_stiffness_most"].value)
        certain = max(helped.strain, nominal.least_strain)
    is_error = certain > STRAIN_ERROR
    strain, limit = (certain, STRAIN_ERROR) if is_error else (most.strain, valid)
    larger = "target" if nominal.loaded_share < LOADED else "or thinner pad"

    def stiffer() -> _StifferPad:
        return memo(design, "stiffer pad", lambda: _find_stiffer_pad(design.spec, force))

    def hint() -> str:
        if stiffer().modulus is None:
            return "compression-larger"
        return "compression-stiffer" if stiffer().preset is None else "compression-preset"

    is_part, is_doubtful = nominal.loaded_share < LOADED, bool(nominal.strain_uncertainty)
    details = (*["compression-helped"] * (is_error and is_doubtful), *["compression-beyond"] * (nominal.strain > valid),
               *["pad-part"] * is_part, *["pad-cut"] * (is_part and is_doubtful))
    yield violation_of(
        "compression-error" if is_error else "compression", "elastomer.material", strain, limit, hint=hint,
        severity=Severity.ERROR if is_error else Severity.WARNING, details=details,
        fixes=(lambda: stiffer().fixes,), force=force, thickness=pad.thickness, rubber=rubber.name,
        nominal=nominal.strain, least=least.strain, most=most.strain, modulus=rubber.shear_modulus, uncertainty=sigma,
        gap=nominal.gap, shape=nominal.shape_factor, valid=valid, loaded=nominal.loaded_share,
        whole=nominal.least_strain, larger=larger, stiffer=lambda: stiffer().modulus,
        preset=lambda: stiffer().preset, preset_modulus=lambda: stiffer().preset_modulus,
        preset_sigma=lambda: stiffer().preset_sigma,
    )


def _strain_in_use_findings(spec: SensorSpec, force: float, nominal: elastomer.Compression) -> Iterator[Verdict]:
    """Yield a finding if the pad's modulus at the temperature of use differs from its modulus at 20 degrees Celsius.

    The least difference is `LEAST_MODULUS_CHANGE`. The finding states the compression at the temperature of use; all
    other estimates are for 20 degrees Celsius. `force` (N) is the required normal force, and `nominal` the compression
    by it at 20 degrees Celsius.
    """
    at, slope = spec.requirements.temperature, require_pad(spec.elastomer).material.modulus_temperature_coefficient
    more = slope * (at - ROOM_TEMPERATURE)
    if abs(more) < LEAST_MODULUS_CHANGE:
        return
    film = spec.encapsulation.material.modulus_temperature_coefficient if spec.encapsulation is not None else 0.0
    factors = {"modulus": 1.0 + more, "film": 1.0 + film * (at - ROOM_TEMPERATURE)}
    there, valid = pressed_pad(spec, **factors).strain, elastomer.VALID_STRAIN
    yield violation_of(
        "compression-in-use", "requirements.temperature", there, valid,
        severity=Severity.WARNING if there > valid >= nominal.strain else Severity.NOTE, keeps_limit=there <= valid,
        temperature=at, room=ROOM_TEMPERATURE, modulus=1.0 + more, force=force, nominal=nominal.strain, slope=slope,
    )


def target_rotation(design: Design) -> Iterator[Verdict]:
    """Yield findings on a pad that is too thick for its width.

    It is an error or a warning if the pad buckles sideways under the required normal force. Otherwise it is a note if
    the ratio of thickness to width exceeds `SLENDERNESS`, because the target then tilts easily.
    """
    if not rests_on_pad(design.spec):
        yield not_checked("beside-pad")
        return
    pad, face = require_pad(design.spec.elastomer), loaded_face(design.spec)[0]
    force = design.spec.requirements.normal_force
    # whether the pad gives way sideways under the required normal force, with the target held level or free
    lost = loaded_poses(design.spec, np.array([(force, 0.0, 0.0)]), np.array([False]))[1][0] if force else ""
    width = min(face.width_x, face.width_y)
    ratio, part = pad.thickness / width, "pad" if width == min(pad.size) else "target"
    if lost not in (PAD_INSTABILITY, TOO_SOFT):
        if ratio > SLENDERNESS + ROUNDING:
            yield violation_of(
                "slender", "elastomer.thickness", ratio, SLENDERNESS, severity=Severity.NOTE, part=part,
                slender=SLENDERNESS * width,
                reading="force" if len(design.spec.array.placements) == 1 else "shear",
            )
        return
    enough = _largest_stable_thickness(design.spec, force or 0.0, SLENDERNESS * width)
    takes_moments = any(design.spec.requirements.moments)  # a target held level takes up moments
    if lost == TOO_SOFT or takes_moments:
        hint = "gives-way-stiffer" if enough is None else "gives-way-thinner"
    else:
        hint = "gives-way-stiffer-level" if enough is None else "gives-way-thinner-level"
    yield violation_of(
        "gives-way-level" if lost == TOO_SOFT else "gives-way-free", "elastomer.thickness", ratio,
        None if enough is None else enough / width, hint=hint,
        severity=Severity.ERROR if lost == TOO_SOFT else Severity.WARNING, force=force or 0.0, part=part,
        enough=enough, fixes=() if enough is None else (
            lambda: [with_value(design.spec, "elastomer.thickness", enough, f"{enough * 1e3:.4g} mm")],),
    )


def _largest_stable_thickness(spec: SensorSpec, force: float, most: float) -> float | None:
    """Return the largest thickness (m) at which the pad does not buckle under the normal force `force` (N).

    The target may tilt. The thickness is a multiple of `THICKNESS_GRAIN`, at most `most` (m) and at most the pad's
    present thickness. None if the pad buckles at every such thickness.
    """
    def holds(grains: int) -> bool:
        thinner = replace(spec, elastomer=replace(require_pad(spec.elastomer), thickness=grains * THICKNESS_GRAIN))
        return not loaded_poses(thinner, np.array([(force, 0.0, 0.0)]), np.array([False]))[1][0]

    low, high = 0, math.floor(min(require_pad(spec.elastomer).thickness, most) / THICKNESS_GRAIN + 1e-6) + 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return round(low * THICKNESS_GRAIN, 9) or None


def elastomer_shear(design: Design) -> Iterator[Verdict]:
    """Yield findings on the sideways travel of the target under the required shear force.

    The travel divided by the pad's thickness is compared with the valid shear strain of the pad. The travel itself is
    compared with half the distance between the coils' centres.
    """
    spec, pad, force = design.spec, require_pad(design.spec.elastomer), design.spec.requirements.shear_force
    pitch = spec.array.pitch
    assert force is not None
    if not rests_on_pad(spec):
        yield not_checked("beside-pad")
        return
    strain = _relative_shear_travel(spec, force)
    yield from _shear_strain_findings(design, force, strain)
    if pitch is None:
        yield not_checked("no-pitch")
        return

    travel, over_coils = strain * pad.thickness, min(elastomer.VALID_SHEAR, 0.5 * pitch / pad.thickness)
    if math.inf > travel > pitch / 2.0:
        yield violation_of(
            "shear-travel", "elastomer.material", travel, pitch / 2.0, "m", force=force,
            uncertainty=pad.material.shear_modulus_sigma, ratio=travel / pad.thickness,
            fixes=(lambda: _with_silicone(spec, _softest_for_shear(spec, force, over_coils)),
                   lambda: other_thicknesses(spec)),
        )


def _relative_shear_travel(spec: SensorSpec, force: float, modulus: float = 1.0) -> float:
    """Return the target's sideways travel under a shear force (N), divided by the pad's thickness.

    The target remains level. The result is the largest of four cases: shear along x or y, without or with the required
    normal force. `modulus` is a factor by which the pad's modulus is multiplied. Infinite if no equilibrium is found.
    """
    normal = spec.requirements.normal_force or 0.0
    loads = np.array([(pressed, *way) for pressed in (0.0, normal) for way in ((force, 0.0), (0.0, force))])
    poses, notes = loaded_poses(spec, loads, modulus=modulus)
    if LOST in notes:
        return math.inf
    assert spec.elastomer is not None
    return float(poses[:, :2].max()) / spec.elastomer.thickness


def _shear_strain_findings(design: Design, force: float, strain: float) -> Iterator[Verdict]:
    """Yield findings on the pad's shear strain under the shear force `force` (N).

    `strain` is the shear strain with the nominal modulus. It is also computed with a modulus one standard deviation
    below nominal. Both are compared with the limits of shear strain.
    """
    spec, limit = design.spec, elastomer.VALID_SHEAR
    softest = _modulus_lower_bound(require_pad(spec.elastomer).material.shear_modulus_sigma)
    usual = _relative_shear_travel(spec, force, softest)
    if usual <= limit:
        # beyond the validated range of the pad's law, as in data sheet and calibration
        validated = validated_shear(spec)
        if force > validated:
            modulus = require_pad(spec.elastomer).material.shear_modulus
            stiffer = _softest_sufficient(
                lambda m, _: m.shear_modulus > modulus and validated_shear(_silicone_fix(spec, m).spec) >= force)
            yield violation_of(
                "shear-validated", "requirements.shear_force", force, validated, "N", severity=Severity.NOTE,
                hint="shear-validated-preset" if stiffer else "", beyond=extrapolated_shear_note(validated),
                preset="" if stiffer is None else stiffer.name,
            )
        return
    material, area = require_pad(spec.elastomer).material, loaded_face(spec)[0].area
    most = strain if strain > limit else usual

    @cache
    def enough() -> ElastomerMaterial | None:
        return _softest_for_shear(spec, force, limit)

    @cache
    def wanted_modulus() -> float:
        more = _modulus_for_shear(spec, force, limit, (softest, usual), strain) / softest
        return _rounded_up(material.shear_modulus * more)

    def wanted_area() -> float:
        return area * wanted_modulus() / material.shear_modulus

    def hint() -> str:
        if spec.jaw is not None and wanted_area() > spec.jaw.width * spec.jaw.length:
            return "shear-jaw-preset" if enough() else "shear-jaw"
        if _has_room(spec, math.sqrt(wanted_area() / area), design.layout.body_outline):
            return "shear-area-preset" if enough() else "shear-area"
        return "shear-body-preset" if enough() else "shear-body"

    case = "shear-strain" if math.isfinite(usual) else "shear-strain-softer"
    yield violation_of(
        case if math.isfinite(strain) else "shear-lost", "elastomer.material",
        most if math.isfinite(most) else None, limit, hint=hint, source=elastomer.SHEAR_SOURCE,
        severity=Severity.WARNING if strain > limit or math.isinf(usual) else Severity.NOTE,
        fixes=(lambda: _with_silicone(spec, enough()),), force=force, rubber=material.name, strain=strain, softer=usual,
        modulus=wanted_modulus, area=wanted_area, now=area,
        face=0.0 if spec.jaw is None else spec.jaw.width * spec.jaw.length,
        preset=lambda: getattr(enough(), "name", ""), body_key=spec.fpc.body_key,
    )


def _silicone_fix(spec: SensorSpec, material: ElastomerMaterial) -> Fix:
    return with_value(spec, "elastomer.material", material, material.name)


def _with_silicone(spec: SensorSpec, material: ElastomerMaterial | None) -> list[Fix]:
    """Return the change to a pad of the silicone `material`, in a list. Empty if `material` is None."""
    return [] if material is None else [_silicone_fix(spec, material)]


def _softest_for_shear(spec: SensorSpec, force: float, limit: float) -> ElastomerMaterial | None:
    """Return the softest silicone whose shear strain by the shear force `force` (N) is at most `limit`.

    The shear strain is computed with a modulus one standard deviation below nominal.
    """
    return _softest_sufficient(
        lambda other, modulus: _relative_shear_travel(_silicone_fix(spec, other).spec, force,
                                                      modulus / other.shear_modulus) <= limit)


def _modulus_for_shear(
    spec: SensorSpec, force: float, limit: float, softer: tuple[float, float], strain: float
) -> float:
    """Return the factor by which the pad's modulus must increase, so that the shear strain is just below `limit`.

    The strain is within 1 % of the limit. `force` is the shear force (N). `softer` is (factor, strain) for a factor at
    which the strain exceeds the limit, and `strain` is the strain at factor 1. The search interpolates between
    logarithms, because shear strain is about inversely proportional to the modulus.
    """
    (low, lower), (high, upper) = softer, (1.0, strain)
    while upper > limit and high < 1e6:
        low, lower, high = high, upper, 2.0 * high
        upper = _relative_shear_travel(spec, force, high)
    while high > 1.0005 * low and upper < 0.99 * limit:
        share = 0.5
        if math.isfinite(lower):
            share = min(max(math.log(lower / (0.995 * limit)) / math.log(lower / upper), 0.05), 0.95)
        middle = low * (high / low) ** share
        sheared = _relative_shear_travel(spec, force, middle)
        if sheared > limit:
            low, lower = middle, sheared
        else:
            high, upper = middle, sheared
    return high


def _has_room(spec: SensorSpec, scale: float, body: Path) -> bool:
    """Whether target and pad would lie on a body's outline if both were larger by the factor `scale`."""
    pad, target = require_pad(spec.elastomer), spec.target
    assert target is not None
    larger = replace(spec, elastomer=replace(pad, size=(scale * pad.size[0], scale * pad.size[1])),
                     target=replace(target, size=(scale * target.size[0], scale * target.size[1])))
    return plates_lie_on_body(plates_of(larger), film_thickness(larger.encapsulation), body)


def target_gap(design: Design) -> Iterator[Verdict]:
    """Yield a finding on a target without an elastomer, which lies on the board itself."""
    if design.spec.elastomer is None:
        film = design.spec.fpc.stackup.layers[0].kind
        yield violation_of("target-gap", "elastomer", 0.0, None, "m",
                           film="bare copper" if film is LayerKind.COPPER else str(film))


def target_bending(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the target bends too much under a contact smaller than the target.

    The bending is the difference between the travel of the target's middle and the travel of its edges, divided by the
    pad's compression.
    """
    spec, target, force = design.spec, design.spec.target, design.spec.requirements.normal_force
    assert target is not None
    if not rests_on_pad(spec):
        yield not_checked("beside-pad")
        return
    limits, contact = constant_limits(), spec.requirements.contact
    is_finger = contact is None
    if contact is None:
        if spec.jaw is not None:
            return
        contact = (limits["fingertip_contact"].value,) * 2
    is_all = all(part >= side for part, side in zip(contact, target.size, strict=True))
    if not force or (is_all and not is_finger):
        return
    if target.material.young_modulus is None:
        yield not_checked("no-young-modulus", metal=target.material.name)
        return
    pad, (face, _) = pressed_pad(spec), loaded_face(spec)
    way = require_pad(spec.elastomer).thickness * pad.strain
    thicker = target.thickness * 1.04 ** np.arange(100)
    rigidities = np.array([rigidity(target.material.young_modulus, sheet) for sheet in thicker])
    stiffness = rigidities * face.area * way / force
    if is_all:
        if stiffness[0] ** 0.25 < limits["evenly_pressed"].value * max(target.size):
            yield not_checked("even-press", thickness=target.thickness, metal=target.material.name)
        return
    bent, limit = plate_deflection(target.size, target.outline.is_disc, contact,
                                   stiffness), limits["target_bending"].value
    if bent[0] > limit:
        enough = _rounded_up(float(thicker[np.argmax(bent <= limit)]))
        is_flat = bent[-1] <= limit
        yield violation_of(
            "target-bends", "target.thickness", float(bent[0]), limit, hint="target-bends-thicker" if is_flat else "",
            fixes=(lambda: [thicker_target(spec, enough)],) if is_flat else (), thickness=target.thickness,
            metal=target.material.name, force=force, contact=contact, enough=enough,
        )


def _modulus_lower_bound(sigma: float) -> float:
    """Return the lower limit of a material's modulus, divided by its nominal modulus.

    It is 1 - `sigma`, but at least 0.05. `sigma` is the standard deviation of the modulus, divided by the modulus.
    """
    return max(0.05, 1.0 - sigma)


@record
class _StifferPad:
    """Smallest shear modulus with which the required force compresses the pad within its valid range, and fixes.

    Attributes
    ----------
    modulus : float or None
        smallest sufficient shear modulus (Pa), rounded up; None if no modulus is sufficient
    preset : str or None
        name of the softest sufficient silicone in the data; None if no silicone is sufficient
    preset_modulus, preset_sigma : float
        shear modulus (Pa) of this silicone, and its relative standard deviation
    fixes : tuple of Fix
        changes of the spec to this silicone and to this modulus
    """

    modulus: float | None = None
    preset: str | None = None
    preset_modulus: float = 0.0
    preset_sigma: float = 0.0
    fixes: tuple[Fix, ...] = ()


def _find_stiffer_pad(spec: SensorSpec, force: float) -> _StifferPad:
    # The softest silicone, and the shear modulus, that keep the softest case within the valid strain, by bisection
    # of the pad's law. Empty if the bulk modulus prevents this.
    pad, face = require_pad(spec.elastomer), loaded_face(spec)[0]
    strain, sigma = elastomer.VALID_STRAIN, pad.material.shear_modulus_sigma
    around = pad_surroundings(spec) or elastomer.BARE

    def bears(rubber: ElastomerMaterial, modulus: float) -> bool:
        block = (face, pad.thickness, modulus, rubber.bulk_modulus, around, rubber.ogden_exponent)
        return elastomer.force_for_strain(strain, *block) >= force

    low, high = 1.0, pad.material.bulk_modulus
    if not bears(pad.material, high):
        return _StifferPad()
    while high > 1.0005 * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if bears(pad.material, middle) else (middle, high)
    least, enough = _rounded_up(high / _modulus_lower_bound(sigma)), _softest_sufficient(bears)
    written = show(least, "Pa", 3)
    change = with_value(spec, "elastomer.material.shear_modulus", least, written,
                        f"a shear modulus of {written} or more")
    fixes = (*_with_silicone(spec, enough), change)
    if enough is None:
        return _StifferPad(least, fixes=fixes)
    return _StifferPad(least, enough.name, enough.shear_modulus, enough.shear_modulus_sigma, fixes)


def _softest_sufficient(bears: Callable[[ElastomerMaterial, float], bool]) -> ElastomerMaterial | None:
    # The softest preset silicone that is stiff enough even one sigma softer. `bears` tests a silicone with
    # this shear modulus (Pa). None if there is none.
    presets = sorted(map(elastomer_preset, names("elastomer")), key=lambda m: (m.shear_modulus, m.name))
    return next((m for m in presets if bears(m, m.shear_modulus * _modulus_lower_bound(m.shear_modulus_sigma))), None)


def _rounded_up(value: float) -> float:
    """Return a positive value rounded up to three significant digits."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.ceil(value / step) * step


RULES: tuple[Rule, ...] = (
    rule_of("SIT304", elastomer_strain, "elastomer", "normal force", source=elastomer.SOURCE,
            warmth_told=100.0 * LEAST_MODULUS_CHANGE),
    rule_of("SIT310", target_rotation, "elastomer", "target"),
    rule_of(
        "SIT312", elastomer_shear, "elastomer", "target", "shear force", valid_shear=100.0 * elastomer.VALID_SHEAR,
        held_shear=100.0 * HELD_SHEAR, shear_source=elastomer.SHEAR_SOURCE,
    ),
    rule_of("SIT313", target_gap, "target"),
    rule_of("SIT327", target_bending, "elastomer", "target", "normal force"),
)
