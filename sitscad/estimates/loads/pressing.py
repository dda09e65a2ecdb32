"""Pad under the required force: its deformation, and the scatter of the deformation by manufacture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from functools import lru_cache, partial

from sitscad.assembly.places.bodies import plates_of
from sitscad.basics.record import memo, record, replace
from sitscad.kernels.geometry.convex import Footprint, centroid
from sitscad.kernels.geometry.path import bounding_box, enclosed_area
from sitscad.kernels.mechanics.elastomer import BARE, Compression, Face, Surround, compress_part, even_rim
from sitscad.kernels.mechanics.pad_law import force_sigma
from sitscad.kernels.mechanics.surround_law import NO_WEBS, Webs, web_effect
from sitscad.spec.places import cell_specs
from sitscad.spec.sensor import SensorSpec

MODULUS, PAD, PAD_SIZE, PART = "elastomer modulus", "elastomer thickness", "elastomer size", "part of the pad loaded"
FILM, FILM_THICKNESS, GLUE = "encapsulation modulus", "encapsulation thickness", "glue lines"
TARGET_SIZE = "target size"
BLOCK = "bonded-block formula"
"""Names of causes that scatter the gap between board and target.

GLUE moves the target away from the board and does not make the pad softer. PART and BLOCK do not differ between units.
PART is the possible excess of the stated strain over the true strain. BLOCK is the error of the formula for the pad's
stiffness.
"""

WHOLE = 0.99  # Fraction of a pad from which on all of it counts as loaded
LEAST = 0.05  # Least factor of a pad's modulus and thickness, however large one sigma is

BESIDE_PAD = "the target lies wholly beside the elastomer, so a force on the target does not press the elastomer"
"""Reason why the pressed state is missing."""

SIGMAS_APART = 2.0  # One sigma of a cause is half of the difference between its two cases


@record
class PressingScatter:
    """Standard deviations of strain, remaining thickness (`gap`, m) and apparent modulus (Pa) of the pressed pad.

    `sigmas_by_cause` are the standard deviations of the strain by cause, and `cause` is the cause with the largest.
    """

    strain: float
    gap: float
    apparent_modulus: float
    cause: str
    sigmas_by_cause: Mapping[str, float] = field(default_factory=dict)


def rests_on_pad(spec: SensorSpec) -> bool:
    """Return whether a force on the target (without a target: on the pad) presses the pad.

    It does not if the target stands wholly beside the pad.
    """
    pad, over = plates_of(spec).elastomer, plates_of(spec).target
    return pad is not None and (
        over is None or memo(spec, "_rests_on_pad", lambda: _overlap(over.footprint, pad.footprint)))


@lru_cache(maxsize=256)
def _overlap(first: Footprint, second: Footprint) -> bool:
    """Return whether two footprints overlap."""
    return first.intersection(second) is not None


def pressed_pad(
    spec: SensorSpec, modulus: float = 1.0, thicker: float = 0.0, wider: float = 0.0, film: float = 1.0,
    thicker_film: float = 0.0, load: float = 1.0,
) -> Compression:
    """Return the deformed pad under the required normal force, which acts through the target if there is one.

    `load` is the acting fraction of this force. The other arguments are for scatter: `modulus` and `film` multiply the
    moduli of pad and film, `thicker`, `wider` and `thicker_film` (m) enlarge them.
    """
    pad = spec.elastomer
    assert pad is not None
    face, beside = loaded_face(spec, wider)
    whole = Face(*pad.size, pad.outline.is_disc).with_added_width(wider)
    thickness = max(LEAST * pad.thickness, pad.thickness + thicker)
    stiffness = max(LEAST, modulus) * pad.material.shear_modulus
    force = load * (spec.requirements.normal_force or 0.0)
    around = pad_surroundings(spec, wider, film, thicker_film)
    material = pad.material
    return compress_part(
        whole, face, thickness, stiffness, material.bulk_modulus, force, beside, around, material.ogden_exponent
    )


def pad_surroundings(
    spec: SensorSpec, wider: float = 0.0, film: float = 1.0, thicker_film: float = 0.0
) -> Surround | None:
    """Return the surroundings of the loaded part of the pad: the pad's rim and the encapsulation's film.

    None if the rim, the part of the pad outside the target, is wider on one side than on another. `wider`, `film` and
    `thicker_film` are as in `pressed_pad`.
    """
    pad, over = plates_of(spec).elastomer, plates_of(spec).target
    assert pad is not None
    around = Surround(webs=pad_webs(spec))
    if spec.encapsulation is not None:
        skin = spec.encapsulation
        modulus = max(LEAST, film) * skin.material.shear_modulus
        thickness = max(LEAST * skin.thickness, skin.thickness + thicker_film)
        around = Surround(0.0, thickness, modulus, skin.material.ogden_exponent)
    if over is None:
        return around
    plan, middle = pad.footprint, over.footprint.centre
    whole, face = Face(*plan.size, plan.is_round).with_added_width(wider), loaded_face(spec, wider)[0]
    if plan.is_round != over.footprint.is_round and face.area < WHOLE * whole.area:
        return None
    offset = middle.x - plan.centre.x, middle.y - plan.centre.y
    rim = even_rim(whole, face, offset, pad.thickness)
    return None if rim is None else replace(around, rim=rim)


def pad_webs(spec: SensorSpec) -> Webs:
    """Return the webs of a pad. If there are several cells, the webs belong to a mean pad."""
    if spec.elastomer is None:
        return NO_WEBS
    h, pads = spec.elastomer.thickness, [cell.elastomer.webs for cell in cell_specs(spec) if cell.elastomer is not None]
    width = max((webs[0] for webs in pads if webs), default=0.0)
    grips = [[web_effect(length / h) if length else 0.0 for length in webs[1:]] or [0.0] * 4 for webs in pads]
    return Webs(width, *(math.fsum(side) / len(pads) for side in zip(*grips, strict=True)))


def formula_sigma(spec: SensorSpec) -> float:
    """Return the relative error of the loaded pad's stiffness by the formula for bonded blocks, as one sigma.

    If there are several cells, it is for their mean pad. It then includes the differences between pads with more and
    fewer webs.
    """
    pad, around, each = spec.elastomer, pad_surroundings(spec) or BARE, web_stiffness(spec)
    assert pad is not None
    material, mean = pad.material, math.fsum(each) / len(each)
    block = around.block(loaded_face(spec)[0], pad.thickness, material.shear_modulus, material.ogden_exponent)
    return math.hypot(force_sigma(block), math.dist(each, len(each) * [mean]) / math.sqrt(len(each)) / mean)


def web_stiffness(spec: SensorSpec) -> list[float]:
    """Return the stiffness of each cell's pad under compression with webs, divided by the stiffness without webs."""
    assert spec.elastomer is not None
    face, thickness, around = loaded_face(spec)[0], spec.elastomer.thickness, pad_surroundings(spec) or BARE
    blocks = (replace(around, webs=pad_webs(cell)).block(face, thickness, 1.0) for cell in cell_specs(spec))
    return [block.web_stiffening.press for block in blocks]


def loaded_face(spec: SensorSpec, wider: float = 0.0) -> tuple[Face, float]:
    """Return the part of the pad under the target, and the distance (m) of its middle from the target's middle.

    Without a target it is the whole pad. The pad is enlarged by `wider` (m). The returned face has the area that pad
    and target share. Its sides are along the sides of the target or of the pad, whichever box the shared area fills
    better.
    """
    pad, over = plates_of(spec).elastomer, plates_of(spec).target
    assert pad is not None
    return memo(spec, f"_loaded {wider}", lambda: _cached_loaded_face(
        pad.footprint, None if over is None else over.footprint, wider))


@lru_cache(maxsize=256)
def _cached_loaded_face(pad: Footprint, over: Footprint | None, wider: float) -> tuple[Face, float]:
    """Return the result of `loaded_face` for the footprints of pad and target.

    All states and causes share the cache. `over` is the target's footprint, None if there is no target. The pad is
    enlarged by `wider` (m).
    """
    whole = Face(*pad.size, pad.is_round).with_added_width(wider)
    if over is None:
        return whole, 0.0
    below = replace(pad, size=(whole.width_x, whole.width_y))
    shared = over.intersection(below)
    if shared is None:
        return whole.with_added_width(-max(whole.width_x, whole.width_y)), over.centre.distance(below.centre)
    area, beside, faces = enclosed_area(shared), centroid(shared).distance(over.centre), []
    for turn in dict.fromkeys((over.rotation, 0.0)):  # the shared area is as round as it fills its bounding box
        x0, y0, x1, y1 = bounding_box([shared.rotated(-turn)])
        filled = area / ((x1 - x0) * (y1 - y0))
        face = Face(x1 - x0, y1 - y0, min(1.0, max(0.0, (1.0 - filled) / (1.0 - math.pi / 4.0))))
        scale = math.sqrt(area / face.area)
        faces.append((filled, Face(scale * face.width_x, scale * face.width_y, face.round)))
    return max(faces, key=lambda face: face[0])[1], beside


def pressed_cases(
    spec: SensorSpec, sigmas: Mapping[str, float], load: float = 1.0
) -> dict[str, tuple[Compression, Compression]]:
    """Return two pressed pads for each cause of scatter: the cause deviates by minus one and by plus one sigma.

    `load` is the acting fraction of the required force. `sigmas` are standard deviations (m) by cause. For the cause
    PART, the two pads have the stated strain, and a strain that is two sigma smaller.
    """
    assert spec.elastomer is not None
    material, around, formula = spec.elastomer.material, pad_surroundings(spec), formula_sigma(spec)
    press = partial(pressed_pad, spec, load=load)

    def modulus(sigma: float) -> tuple[Compression, Compression]:
        return press(modulus=1.0 - sigma), press(modulus=1.0 + sigma)

    cases = {MODULUS: modulus(material.shear_modulus_sigma)}
    if around is not None and around.film:
        film = spec.encapsulation.material.shear_modulus_sigma if spec.encapsulation is not None else 0.0
        cases[FILM] = press(film=1.0 - film), press(film=1.0 + film)
        if thicker := sigmas.get(FILM_THICKNESS):
            cases[FILM_THICKNESS] = press(thicker_film=-thicker), press(thicker_film=thicker)
    cases[BLOCK] = modulus(formula)
    if pad := sigmas.get(PAD):
        cases[PAD] = press(thicker=-pad), press(thicker=pad)
    if size := sigmas.get(PAD_SIZE):
        cases[PAD_SIZE] = press(wider=-size), press(wider=size)
    plate = spec.target
    if (size := sigmas.get(TARGET_SIZE)) and plate is not None:
        less, more = (replace(spec, target=replace(plate, size=(plate.size[0] + by, plate.size[1] + by)))
                      for by in (-size, size))
        cases[TARGET_SIZE] = pressed_pad(less, load=load), pressed_pad(more, load=load)
    return cases | _stated_strain_pads(press(), spec.elastomer.thickness)


def linearised_cases(
    spec: SensorSpec, sigmas: Mapping[str, float], nominal: Compression, load: float = 1.0
) -> dict[str, tuple[Compression, Compression]]:
    """Return a linear, faster form of `pressed_cases` about the `nominal` pad: two pressed pads for each cause.

    The causes are modulus, thickness and the formula for the stiffness. An error of the formula is treated as an error
    of the modulus. `sigmas` are standard deviations (m) by cause, and `load` is the acting fraction of the required
    force.
    """
    assert spec.elastomer is not None
    material, formula = spec.elastomer.material, formula_sigma(spec)
    modulus = max(material.shear_modulus_sigma, formula, 1e-3)

    def straight(case: Compression, part: float) -> tuple[Compression, Compression]:
        """Return two pads that differ from the nominal pad by plus and minus `part` of its difference from `case`."""
        changes = {name: part * (getattr(case, name) - getattr(nominal, name))
                for name in ("strain", "gap", "apparent_modulus")}
        less, more = ({name: getattr(nominal, name) + side * way for name, way in changes.items()} for side in (1, -1))
        return replace(nominal, **less), replace(nominal, **more)

    softer = pressed_pad(spec, modulus=1.0 - modulus, load=load)
    cases = {MODULUS: straight(softer, material.shear_modulus_sigma / modulus),
             BLOCK: straight(softer, formula / modulus)}
    if sigmas.get(PAD):
        cases[PAD] = straight(pressed_pad(spec, thicker=-sigmas[PAD], load=load), 1.0)
    return cases | _stated_strain_pads(nominal, spec.elastomer.thickness)


def pressing_scatter(cases: Mapping[str, tuple[Compression, Compression]]) -> PressingScatter:
    """Return the standard deviations of a pressed pad from `cases`, the result of `pressed_cases`.

    The causes are taken as independent.
    """
    strain, gap, modulus = (
        {cause: abs(getattr(a, name) - getattr(b, name)) / SIGMAS_APART for cause, (a, b) in cases.items()}
        for name in ("strain", "gap", "apparent_modulus")
    )
    of_strain, of_gap, of_modulus = (math.hypot(*each.values()) for each in (strain, gap, modulus))
    return PressingScatter(of_strain, of_gap, of_modulus, max(strain, key=lambda cause: strain[cause]), strain)


def _stated_strain_pads(nominal: Compression, thickness: float) -> dict[str, tuple[Compression, Compression]]:
    """Return the two pads of the cause PART: the nominal pad, and a pad with a strain that is two sigma smaller.

    Empty if the strain has no such error. The apparent modulus of both pads is equal. `thickness` (m) is the pad's.
    """
    if not nominal.strain_uncertainty > 0.0:
        return {}
    strain = max(nominal.strain - SIGMAS_APART * nominal.strain_uncertainty, LEAST * nominal.strain)
    return {PART: (nominal, replace(nominal, strain=strain, gap=thickness * (1.0 - strain)))}
