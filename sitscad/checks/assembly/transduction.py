"""SIT304, SIT310, SIT312, SIT313 and SIT327: whether pad and target turn force into signal."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

from sitscad.checks.assembly.fit import ROUNDING, pad_of
from sitscad.checks.assembly.plates import lies
from sitscad.checks.rules import Case, Rule, Undecided, Verdict, own_limits, rule_of, worded
from sitscad.design import Design
from sitscad.estimates.states.pressing import BESIDE_PAD, loaded_face, pressed, rests_on_pad, surround
from sitscad.finding import Severity
from sitscad.mechanics import elastomer
from sitscad.mechanics.pad import HELD_SHEAR
from sitscad.remedy.moves import stiffer_pad
from sitscad.remedy.pads import other_thicknesses
from sitscad.remedy.search import Fix, Left, first_tried, setting, tried
from sitscad.scene.stack import ground
from sitscad.spec.circuit import LayerKind
from sitscad.spec.materials import ElastomerMaterial
from sitscad.spec.presets import elastomer as elastomer_preset
from sitscad.spec.presets import names
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show

STRAIN_ERROR = 0.5
LOADED = 0.99
"""Share of a pad from which on it counts as loaded all over."""

SLENDERNESS = 0.25
"""Thickness over width of the 8 x 8 x 2 mm bench pad (Jones, thesis, Leeds), whose target was seen to stay level."""


def elastomer_strain(design: Design) -> Iterator[Verdict]:
    """How far the required force compresses the pad, with the spread of its modulus."""
    pad, force = pad_of(design), design.spec.requirements.normal_force
    assert force is not None
    if not rests_on_pad(design.spec):
        yield Undecided(BESIDE_PAD)
        return
    material, sigma = pad.material, pad.material.shear_modulus_sigma
    nominal, least, most = (pressed(design.spec, modulus=factor) for factor in (1.0, 1.0 + sigma, _softest(sigma)))
    if most.strain <= elastomer.VALID_STRAIN:
        return
    certain = _at_least(design, nominal)
    is_error = certain > STRAIN_ERROR
    judged = "even helped most by the rest of the pad" if nominal.doubt else "that"
    yield TOO_SOFT.found(
        "elastomer.material", certain if is_error else most.strain,
        STRAIN_ERROR if is_error else elastomer.VALID_STRAIN, None,
        advice=(lambda left: _stiffer(design, force, left) + _otherwise(nominal)) if is_error else None,
        is_grave=is_error, force=force, thickness=pad.thickness, name=material.name, strain=nominal.strain,
        least_strain=least.strain, most_strain=most.strain, shear_modulus=material.shear_modulus, scatter=sigma,
        gap=nominal.gap, shape_factor=nominal.shape_factor, taken=_part(nominal),
        which=judged if is_error else "the softest case",
        extrapolated=worded(EXTRAPOLATED, {"valid": elastomer.VALID_STRAIN}) if nominal.strain > elastomer.VALID_STRAIN
        else "", stiffer=_stiffer(design, force), otherwise=_otherwise(nominal),
    )


def _at_least(design: Design, nominal: elastomer.Compression) -> float:
    """The strain that is certain: what lies around a target on a part of its pad makes that stiffer by so much at most,
    and no pad gives way less than with all of it loaded.
    """
    if not nominal.doubt:
        return nominal.strain
    helped = pressed(design.spec, modulus=1.0 + own_limits()["surround_stiffness_most"].value)
    return max(helped.strain, nominal.least_strain)


def _otherwise(nominal: elastomer.Compression) -> str:
    """What else makes a pad give way less, and what to be sure of first."""
    larger = "target" if nominal.loaded_share < LOADED else "or thinner pad"
    return (
        f"a larger {larger} gives way less. Measure a coupon: data sheets differ from measurements by 1.1 to 3.7 times"
    )


def target_rotation(design: Design) -> Iterator[Verdict]:
    """Thickness over width of the pad under the target: slender pads let it tilt, and give way under the force."""
    if not rests_on_pad(design.spec):
        yield Undecided(BESIDE_PAD)
        return
    pad, face, lost = pad_of(design), loaded_face(design.spec)[0], _gives_way(design)
    width = min(face.width_x, face.width_y)
    ratio = pad.thickness / width
    if ratio > SLENDERNESS + ROUNDING or lost:
        yield (lost or TOO_SLENDER).found(
            "elastomer.thickness", ratio, SLENDERNESS, None, force=design.spec.requirements.normal_force,
            wide="wide" if width == min(pad.size) else "the target is wide",
            reading="force" if len(design.spec.array.placements) == 1 else "shear", slender=SLENDERNESS * width,
        )


def _gives_way(design: Design) -> Case | None:
    """What is said of a pad that gives way sideways under the required normal force, the target held level or free."""
    import numpy as np

    from sitscad.estimates.response.pad import GIVES_WAY, TOO_SOFT, pushed

    force = design.spec.requirements.normal_force
    if not force:
        return None
    _, (note,) = pushed(design.spec, np.array([(force, 0.0, 0.0)]), np.array([False]))
    return {GIVES_WAY: GIVES_WAY_FREE, TOO_SOFT: GIVES_WAY_LEVEL}.get(note)


def elastomer_shear(design: Design) -> Iterator[Verdict]:
    """How far the required shear force moves the target, against the pad's thickness and half the coils' distance."""
    pad, force, pitch = pad_of(design), design.spec.requirements.shear_force, design.spec.array.pitch
    assert force is not None
    if not rests_on_pad(design.spec):
        yield Undecided(BESIDE_PAD)
        return
    strain = _sheared(design.spec, force)
    yield from _shear_strain(design, force, strain)
    if pitch is None:
        yield Undecided("no pitch: the coils have no common distance")
        return
    travel = strain * pad.thickness
    if math.inf > travel > pitch / 2.0:
        yield PAST_THE_COILS.found("elastomer.material", travel, pitch / 2.0, "m", force=force,
                                   shear_modulus_sigma=pad.material.shear_modulus_sigma, share=travel / pad.thickness,
                                   advice=lambda left: _stays_over_the_coils(design.spec, force, left))


def _stays_over_the_coils(spec: SensorSpec, force: float, left: Left) -> str:
    """A hint with the softest silicone on which the target stays over the coils, then with pads of other thickness."""
    assert spec.elastomer is not None and spec.array.pitch is not None
    most = min(elastomer.VALID_SHEAR, 0.5 * spec.array.pitch / spec.elastomer.thickness)
    enough = _softest_for_shear(spec, force, most)
    silicones = [] if enough is None else [_of(spec, enough)]
    return first_tried([silicones, list(other_thicknesses(spec))], PAST_THE_COILS.hint)(left)


def _sheared(spec: SensorSpec, force: float, modulus: float = 1.0) -> float:
    """Travel over thickness under a shear force (N), the target held level, by the pad's law along the axis that gives
    way more, pressed by the required force or not, whichever lets it go farther (as the range in a data sheet,
    `shear_at`); the modulus times a factor. Endless where no equilibrium is found.
    """
    import numpy as np

    from sitscad.estimates.response.pad import TOO_SOFT as LOST
    from sitscad.estimates.response.pad import pushed

    normal = spec.requirements.normal_force or 0.0
    loads = np.array([(pressed, *way) for pressed in (0.0, normal) for way in ((force, 0.0), (0.0, force))])
    poses, notes = pushed(spec, loads, modulus=modulus)
    if LOST in notes:
        return math.inf
    assert spec.elastomer is not None
    return float(poses[:, :2].max()) / spec.elastomer.thickness


def _shear_strain(design: Design, force: float, strain: float) -> Iterator[Verdict]:
    """The shear strain with the pad's own modulus, and with one that is a sigma softer."""
    spec, limit = design.spec, elastomer.VALID_SHEAR
    material, area = pad_of(design).material, loaded_face(design.spec)[0].area
    softest = _softest(material.shear_modulus_sigma)
    usual = _sheared(spec, force, softest)
    if usual <= limit:
        # beyond what the pad's law was held against, as data sheet and calibration say
        from sitscad.estimates.response.working_range import beyond_held_shear, held_shear

        held = held_shear(spec)
        if force > held:
            yield EXTRAPOLATED_SHEAR.found("requirements.shear_force", force, held, "N", beyond=beyond_held_shear(held))
        return
    beyond = strain > limit
    factor = _modulus_for_shear(design, force, limit, (softest, usual), strain)
    most = strain if beyond else usual
    is_borne = math.isfinite(strain) and math.isfinite(usual)
    enough = _softest_for_shear(spec, force, limit)
    hint = worded(TOO_MUCH_SHEAR.hint, {"enough": _rounded_up(material.shear_modulus * factor / softest),
                                        "softest_preset": _named_preset(enough),
                                        "larger_area": _larger_area(design, area, area * factor / softest)})

    def stiff_enough(left: Left) -> str:
        # the softest silicone that is stiff enough where trying finds that it mends, before what else would
        fix = None if enough is None else _of(spec, enough)
        return "" if fix is None or left(fix) != () else f"{fix.words}{tried(fix, left)}; or {hint}"

    yield TOO_MUCH_SHEAR.found("elastomer.material", most if math.isfinite(most) else None, limit, None,
                               source=elastomer.SHEAR_SOURCE, is_grave=beyond or not is_borne, hint=hint,
                               advice=lambda left: stiff_enough(left) or hint, force=force,
                               moved=_travel(strain), name=material.name, usual=_travel(usual))


def _of(spec: SensorSpec, material: ElastomerMaterial) -> Fix:
    return setting(spec, "elastomer.material", material, material.name)


def _softest_for_shear(spec: SensorSpec, force: float, limit: float) -> ElastomerMaterial | None:
    """The softest silicone that a shear force (N) strains by no more than a limit, a sigma softer, too."""
    return _softest_enough(
        lambda other, modulus: _sheared(_of(spec, other).spec, force, modulus / other.shear_modulus) <= limit
    )


def _travel(strain: float) -> str:
    return f"by {100.0 * strain:.0f} % of its thickness" if math.isfinite(strain) else "out of its place: it gives way"


def _modulus_for_shear(design: Design, force: float, limit: float, softer: tuple[float, float], strain: float) -> float:
    """The factor on the pad's modulus that keeps its shear strain just below a limit (within 1 %), as shear falls with
    it: between two by their shears' logarithms, for shear goes about as one over it. `softer` is a factor and its
    strain beyond the limit, `strain` that of the modulus itself.
    """
    (low, lower), (high, upper) = softer, (1.0, strain)
    while upper > limit and high < 1e6:
        low, lower, high = high, upper, 2.0 * high
        upper = _sheared(design.spec, force, high)
    while high > 1.0005 * low and upper < 0.99 * limit:
        share = 0.5
        if math.isfinite(lower):
            share = min(max(math.log(lower / (0.995 * limit)) / math.log(lower / upper), 0.05), 0.95)
        middle = low * (high / low) ** share
        found = _sheared(design.spec, force, middle)
        if found > limit:
            low, lower = middle, found
        else:
            high, upper = middle, found
    return high


def _larger_area(design: Design, area: float, wanted: float) -> str:
    """A larger target and pad (m2) as the other way, where the jaw's face has room for them."""
    mount = design.spec.mount
    room = mount.jaw.width * mount.jaw.length if mount is not None and mount.jaw is not None else math.inf
    if wanted > room:
        return f" (target and pad would have to be {_mm2(wanted)}, the jaw's face has {_mm2(room)})"
    scale, pad, target = math.sqrt(wanted / area), pad_of(design), design.spec.target
    assert target is not None
    larger = replace(design.spec, elastomer=replace(pad, size=(scale * pad.size[0], scale * pad.size[1])),
                     target=replace(target, size=(scale * target.size[0], scale * target.size[1])))
    body = f" on a larger body ({design.spec.fpc.body_key}), for this one is too small"
    body = "" if lies(larger, ground(design.layout)) else body
    return f", or a target and pad of {_mm2(wanted)} instead of {_mm2(area)}{body},"


def _mm2(area: float) -> str:
    return f"{show(area * 1e6, '', 3)} mm2"


def target_gap(design: Design) -> Iterator[Verdict]:
    """A target needs something soft to lie on: without an elastomer it lies on the board itself."""
    if design.spec.elastomer is None:
        top = design.spec.fpc.stackup.layers[0].kind
        yield NO_GAP.found("elastomer", 0.0, None, "m", top="bare copper" if top is LayerKind.COPPER else f"the {top}")


def target_bending(design: Design) -> Iterator[Verdict]:
    """How much farther the target's middle goes down than its edges, where not all of it is pressed."""
    spec, target, force = design.spec, design.spec.target, design.spec.requirements.normal_force
    assert target is not None
    if not rests_on_pad(spec):
        yield Undecided(BESIDE_PAD)
        return
    limits, contact = own_limits(), spec.requirements.contact
    if contact is None:
        if spec.mount is not None and spec.mount.jaw is not None:
            return
        contact = (limits["fingertip_contact"].value,) * 2
    if not force or all(part >= side for part, side in zip(contact, target.size, strict=True)):
        return
    if target.material.young_modulus is None:
        yield Undecided(f"no Young's modulus of {target.material.name} is known")
        return
    import numpy as np

    from sitscad.mechanics.plate_bending import bending, rigidity

    pad, (face, _) = pressed(spec), loaded_face(spec)
    way = pad_of(design).thickness * pad.strain
    thicker = target.thickness * 1.04 ** np.arange(100)
    stiffness = np.array([rigidity(target.material.young_modulus, one) for one in thicker]) * face.area * way / force
    bent, limit = bending(target.size, target.outline.is_round, contact, stiffness), limits["target_bending"].value
    if bent[0] > limit:
        enough = _rounded_up(float(thicker[np.argmax(bent <= limit)])) if bent[-1] <= limit else None
        yield BENDS.found("target.thickness", float(bent[0]), limit, None, force=force, x=contact[0], y=contact[1],
                          thickness=target.thickness, metal=target.material.name,
                          enough="" if enough is None else worded(ENOUGH, {"thick": enough}))


def _part(pressed: elastomer.Compression) -> str:
    """In words, that only part of the pad is loaded."""
    if pressed.loaded_share >= LOADED:
        return ""
    share = f"; the target loads {100.0 * pressed.loaded_share:.0f} % of the pad"
    if not pressed.doubt:
        return share
    return f"{share}, which is taken as cut out (were all of it loaded, {100.0 * pressed.least_strain:.0f} %)"


def _softest(sigma: float) -> float:
    """The share of its modulus that a material of a relative uncertainty may have in the softest case."""
    return max(0.05, 1.0 - sigma)


def _stiffer(design: Design, force: float, left: Left | None = None) -> str:
    """The shear modulus that keeps even the softest case within the valid strain; nothing where bulk limits it.

    By bisection of the pad's law; `left`, which costs another estimate, tells what else it breaks.
    """
    pad, face = pad_of(design), loaded_face(design.spec)[0]
    strain, sigma = elastomer.VALID_STRAIN, pad.material.shear_modulus_sigma
    around = surround(design.spec) or elastomer.BARE
    size = (face.width_x, face.width_y, pad.thickness)

    def bears(rubber: ElastomerMaterial, modulus: float) -> bool:
        block = (*size, modulus, rubber.bulk_modulus, face.round, around, rubber.ogden_exponent)
        return elastomer.force_for_strain(strain, *block) >= force

    low, high = 1.0, pad.material.bulk_modulus
    if not bears(pad.material, high):
        return ""
    while high > 1.0005 * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if bears(pad.material, middle) else (middle, high)
    change = stiffer_pad(design.spec, _rounded_up(high / _softest(sigma)))
    known = f", known to +- {100.0 * sigma:.0f} % as here," if sigma > 0.0 else ""
    result = f"keeps the softest case within {100.0 * strain:.0f} %"
    named = _named_preset(_softest_enough(bears))
    return f"{change.words}{known} {result}{tried(change, left) if left else ''}{named}; "


def _softest_enough(bears: Callable[[ElastomerMaterial, float], bool]) -> ElastomerMaterial | None:
    """The softest silicone with a preset that is stiff enough a sigma softer, too: `bears` tells it of a silicone and
    its shear modulus (Pa) then. None where none is.
    """
    presets = sorted(map(elastomer_preset, names("elastomer")), key=lambda m: (m.shear_modulus, m.name))
    return next((m for m in presets if bears(m, m.shear_modulus * _softest(m.shear_modulus_sigma))), None)


def _named_preset(found: ElastomerMaterial | None) -> str:
    """That silicone in words; nothing where there is none."""
    if found is None:
        return ""
    known = f"{show(found.shear_modulus, 'Pa', 3)} +- {100.0 * found.shear_modulus_sigma:.0f} %"
    return f" (the softest preset that does is {found.name}, {known})"


def _rounded_up(value: float) -> float:
    """The next value of three digits, never below."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.ceil(value / step) * step


EXTRAPOLATED = "; beyond {valid:%.0f} % the pad's law is extrapolated"

TOO_SOFT = Case(
    "{force:N} compress the {thickness:m} {name} pad by {strain:%.0f} % ({least_strain:%.0f} to {most_strain:%.0f} % "
    "with the modulus {shear_modulus:Pa,3} +- {scatter:%.0f} %), down to {gap:m,3}",
    detail="{which}, {measured:%.1f} %, is more than {limit:%.0f} %{extrapolated}; shape factor "
    "{shape_factor:.2f}{taken}", hint="{stiffer}{otherwise}", severity=Severity.WARNING, grave=Severity.ERROR,
)

_SLENDER = "the elastomer is {measured:.2g} times as thick as {wide}"

TOO_SLENDER = Case(
    _SLENDER + ": the target tilts easily, and tilt reads as {reading}",
    hint="{slender:m,3} is as slender as the bench pad that stayed level (8 x 8 x 2 mm; Jones, thesis, Leeds); thinner "
    "is steadier still", severity=Severity.NOTE,
)

GIVES_WAY_FREE = Case(
    _SLENDER + ": under {force:N} it gives way sideways where the target is free to tilt, and no reading is one force",
    hint="{slender:m,3} stays level, as the bench pad did (8 x 8 x 2 mm; Jones, thesis, Leeds); or a stiffer one, or a "
    "face that keeps the target level", severity=Severity.WARNING,
)

GIVES_WAY_LEVEL = Case(
    _SLENDER + ": under {force:N} it gives way sideways, even with the target held level, and the target is off the "
    "coils",
    hint="{slender:m,3} is as slender as the bench pad that stayed level (8 x 8 x 2 mm; Jones, thesis, Leeds); or a "
    "stiffer one", severity=Severity.ERROR,
)

PAST_THE_COILS = Case(
    "{force:N} of shear move the target by about {measured:m,2} (+- {shear_modulus_sigma:%.0f} % with its modulus; "
    "{share:.2g} times the pad's thickness); beyond {limit:m} it has passed a coil's centre and the signal turns back",
    hint="a stiffer, a larger or a thinner pad",
)

EXTRAPOLATED_SHEAR = Case(
    "{measured:N} of shear are required; {beyond}",
    hint="a stiffer pad, or a larger one under a larger target, goes less far", severity=Severity.NOTE,
)

TOO_MUCH_SHEAR = Case(
    "{force:N} of shear, with the required normal force or without, move the target on the {name} pad {moved} ({usual} "
    "with a modulus one sigma softer)",
    detail="beyond {limit:%.0f} % (a conservative figure, unverified) the travel is extrapolated, and bond and edges "
    "of the pad may peel",
    hint="a shear modulus of {enough:Pa,3} or more known as well as this one{larger_area} keeps the softest case "
    "within it{softest_preset}; a thinner pad shortens the travel, not this share", severity=Severity.NOTE,
    grave=Severity.WARNING,
)

NO_GAP = Case(
    "the target lies on the board, at gap 0: no elastomer is under it, so no force moves it, and "
    "the numbers at rest are those of metal against {top}",
    hint="add an elastomer (like elastomer: {{thickness: 1}}): its thickness is the gap between board and target",
)

BENDS = Case(
    "{thickness:m} of {metal} bend: where {force:N} press {x:m} x {y:m} of its middle, that goes down by "
    "{measured:%.0f} % of the pad's way more than the target's edges, and all numbers are those of a rigid plate",
    detail="{limit:%.0f} % are borne; requirements.contact says what presses",
    hint="{enough}something stiff that is no metal glued on it, and its size as requirements.contact",
)

ENOUGH = "{thick:m,2} of the same metal stay flat; or "


RULES: tuple[Rule, ...] = (
    rule_of("SIT304", elastomer_strain, "elastomer", "normal force", source=elastomer.SOURCE),
    rule_of("SIT310", target_rotation, "elastomer", "target"),
    rule_of(
        "SIT312", elastomer_shear, "elastomer", "target", "shear force", valid_shear=100.0 * elastomer.VALID_SHEAR,
        held_shear=100.0 * HELD_SHEAR, shear_source=elastomer.SHEAR_SOURCE,
    ),
    rule_of("SIT313", target_gap, "target"),
    rule_of("SIT327", target_bending, "elastomer", "target", "normal force"),
)
