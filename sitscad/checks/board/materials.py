"""SIT137 and SIT138: the materials of the stack-up's layers, and the adhesive of its coverlays."""

from __future__ import annotations

from collections.abc import Iterator

from sitscad.checks.rules import ROUNDING, Rule, Verdict, Violation, rule_of
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.fixes.moves import read_anew
from sitscad.spec import presets
from sitscad.spec.circuit import MASK, LayerKind, StackLayer
from sitscad.units import show

BASE, BOND, COVER = "base", "bond", "cover"
USUAL = {LayerKind.DIELECTRIC: "polyimide", LayerKind.COVERLAY: "polyimide-coverlay"}
USES = {LayerKind.DIELECTRIC: (BASE, BOND), LayerKind.COVERLAY: (COVER,)}


def layer_materials(design: Design) -> Iterator[Verdict]:
    """Yield a finding about the first layer of an unsuitable material, or the first copper layer without a base."""
    layers = design.spec.fpc.stackup.layers
    for index, layer in enumerate(layers):
        uses = USES.get(layer.kind, ())
        if uses and not set(uses) & set(presets.dielectric_roles(layer.material)):
            what = "a dielectric between copper layers" if layer.kind is LayerKind.DIELECTRIC else "a coverlay"
            yield _other_material(design, index, f"{layer.material} does not serve as {what}", layer.kind)
            return
    coppers = [index for index, layer in enumerate(layers) if layer.kind is LayerKind.COPPER]
    for index in coppers:
        beside = [k for k in (*_beside(layers, index, -1), *_beside(layers, index, 1))]
        if not any(BASE in presets.dielectric_roles(layers[k].material) for k in beside):
            number = coppers.index(index) + 1
            if not beside:
                yield Violation(
                    f"copper {number} has no dielectric beside it: it lies between coverlays alone",
                    "write a dielectric below it, like {dielectric: 25 um, material: polyimide}", "fpc.stackup",
                )
            else:
                names = " and ".join(dict.fromkeys(layers[k].material for k in beside))
                said = f"copper {number} lies on {names} alone, a bonding material that does not carry copper"
                yield _other_material(design, beside[0], said, LayerKind.DIELECTRIC)
            return


def _beside(layers: tuple[StackLayer, ...], index: int, step: int) -> Iterator[int]:
    """Yield the indices of the dielectrics between a copper layer and the next one, upwards (-1) or downwards (1)."""
    index += step
    while 0 <= index < len(layers) and layers[index].kind is LayerKind.DIELECTRIC:
        yield index
        index += step


def _other_material(design: Design, index: int, message: str, kind: LayerKind) -> Violation:
    """Return the finding about a layer's material. Its hint names the materials that suit the layer."""
    serving = [name for name in presets.names("dielectric") if set(USES[kind]) & set(presets.dielectric_roles(name))]
    if kind is LayerKind.DIELECTRIC:
        serving = [name for name in serving if BASE in presets.dielectric_roles(name)]
    key = f"fpc.stackup.{index}.material"
    hint = f"{key}: {' or '.join(serving)}"
    usual = "FR4" if kind is LayerKind.DIELECTRIC and presets.is_rigid(design.spec.fpc.stackup) else USUAL[kind]
    return Violation(message, hint, key, fixes=(lambda: read_anew(design.spec, key, usual),))


def coverlay_adhesive(design: Design) -> Iterator[Verdict]:
    """Yield a finding about each coverlay film with less adhesive than the copper under it needs. An adhesive that is
    not stated counts as all but the thinnest film in stock.
    """
    stackup, coil = design.spec.fpc.stackup, design.spec.coil
    thinnest = min(film for film, _ in presets.coverlay_films())
    for side, layer, copper in stackup.covers:
        asked = presets.least_adhesive(copper.thickness)
        most = layer.adhesive or max(0.0, layer.thickness - thinnest)
        if layer.material == MASK or most >= asked - ROUNDING:
            continue
        gaps = coil.trace_spacing / (coil.trace_width + coil.trace_spacing) if copper.number in coil.layers else 0.0
        has = show(most, "m") if layer.adhesive else f"at most {show(most, 'm')}"
        film, adhesive = presets.best_film(asked)
        is_preset = stackup.name in presets.names("stackup")
        key = "fpc.stackup" if is_preset else f"fpc.stackup.{0 if side == 'top' else len(stackup.layers) - 1}"
        yield Violation(
            f"the {side} coverlay has {has} of adhesive over {show(copper.thickness, 'm')} of copper, minimum "
            f"{show(asked, 'm', 3)}",
            f"{{coverlay: {show(film + adhesive, 'm')}, adhesive: {show(adhesive, 'm')}}} is in stock; or thinner "
            "copper (fpc.plated: buttons)", key, most, asked, "m",
            Severity.ERROR if 0.0 < layer.adhesive < gaps * copper.thickness - ROUNDING else Severity.WARNING,
            detail="" if layer.adhesive else
            f"the adhesive is not stated; the thinnest film in stock, {show(thinnest, 'm')}, leaves that",
        )


RULES: tuple[Rule, ...] = (rule_of("SIT137", layer_materials), rule_of("SIT138", coverlay_adhesive))
