"""Conversion of the flexible circuit as written to `FpcSpec`: stack-up, design rules, tail, panel and body."""

from __future__ import annotations

import math
from dataclasses import replace

from sitscad.basics.units import count_text, show
from sitscad.spec import presets
from sitscad.spec.circuit import (
    MOST_PARTS,
    BendDocument,
    FpcSpec,
    LayerDocument,
    LayerKind,
    PanelSpec,
    Plating,
    StackLayer,
    Stackup,
    Tail,
)
from sitscad.spec.coil import CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.format.section import WRITTEN_SOURCE
from sitscad.spec.mount import Mount
from sitscad.spec.profiles import Origin, resolve_rules
from sitscad.spec.reading import Remarks
from sitscad.spec.resolver.body import resolve_body

_DEFAULT_STACKUP = {1: "flex-2l-30um", 2: "flex-2l-30um", 3: "flex-4l", 4: "flex-4l", 5: "flex-6l", 6: "flex-6l"}
_LARGEST_STACKUP = "flex-8l"
USUAL_PLATING = 12e-6
"""Plating (m) of the presets. Fabricators add 8 to 15 um to the foil (wellerpcba.com)."""
_TURN_RADIUS = 2e-3
ROUNDING = 1e-9


def resolve_fpc(
    document: FpcSpec, coil: CoilSpec, mount: Mount | None, remarks: Remarks, place: Origin
) -> FpcSpec:
    """Return the flexible circuit with stack-up, design rules, tail, panel and body filled in.

    `place` is the spec: file names are relative to its folder. Errors, such as a stack-up that lacks a copper layer of
    the coil, are recorded in `remarks`.
    """
    as_written = document.values()
    stackup = _stackup(as_written["stackup"], coil, remarks)
    copper = len(stackup.copper)
    stackup = _plated_stackup(stackup, document, remarks)
    if max(coil.layers) > copper:
        message = f"the coil uses copper layer {max(coil.layers)}, stack-up {stackup.name} has {copper}"
        facts = {"measured": float(max(coil.layers)), "limit": float(copper)}
        name = next(iter(presets.stackups_of(max(coil.layers), presets.is_rigid(stackup))), "")
        more = f", like fpc.stackup: {name}" if name else ""
        hint = f"use fewer layers, or a stack-up with more copper{more}"
        remarks.flaw("SIT009", "coil.layers", message, hint, **facts)
    rules = resolve_rules(as_written["rules"], stackup.line_foil(coil.layers), place, remarks)
    written, panel = document.tail, _panel(as_written["panel"], remarks)
    if written is not None and presets.is_rigid(stackup) and "fpc.tail.bend" not in place.source.keys:
        remarks.default("fpc.tail.bend", "none", "a rigid board does not bend")
        written = replace(written, bend="none")
    tail = _tail(written, copper, rules, mount, remarks)
    rules = rules.for_layers(copper)
    body, largest = (
        resolve_body(getattr(document, name), f"fpc.{name}", place, remarks) for name in ("body", "largest")
    )
    if document.body is not None and any(document.margin):
        message = "a body of a given outline is as large as that says"
        remarks.flaw("SIT009", "fpc.margin", message, "leave fpc.margin out, or fpc.body")
    foil = document.copper
    if presets.is_rigid(stackup) and "fpc.copper" not in place.source.keys:
        foil = "electrodeposited"
        remarks.default("fpc.copper", foil, "the usual foil of rigid boards")
    return replace(
        document, copper=foil, stackup=stackup, rules=rules, tail=tail, panel=panel, body=body, largest=largest
    )


def _panel(written: str | PanelSpec, remarks: Remarks) -> PanelSpec:
    if isinstance(written, str):
        return PanelSpec(wish=written)
    boards = math.prod(written.parts or ())
    if boards > MOST_PARTS:
        remarks.flaw(
            "SIT006", "fpc.panel.parts", f"{boards} boards on one panel are out of range: at most {MOST_PARTS}, "
            "because every file has each copy in full", "order several panels", measured=float(boards),
            limit=float(MOST_PARTS),
        )
    return written


def _stackup(written: Stackup | list[LayerDocument] | None, coil: CoilSpec, remarks: Remarks) -> Stackup:
    if isinstance(written, list):
        # a stack-up written layer by layer; impossible layers are flaws
        stack = [_stack_layer(layer, f"fpc.stackup.{index}", remarks) for index, layer in enumerate(written)]
        kinds = [layer.kind for layer in stack]
        if not 1 <= kinds.count(LayerKind.COPPER) <= 8 or len(stack) > 40:
            message = (
                f"{kinds.count(LayerKind.COPPER)} copper layers in {len(stack)} are out of range: 1 to 8 in at most 40"
            )
            remarks.flaw("SIT006", "fpc.stackup", message, "write the layers from top to bottom")
        for index, kind in enumerate(kinds):
            if kind is LayerKind.COVERLAY and 0 < index < len(kinds) - 1:
                message = "coverlay lies inside the stack-up"
                remarks.flaw("SIT009", f"fpc.stackup.{index}", message, "inside, write dielectric")
            if kind is LayerKind.COPPER and index and kinds[index - 1] is LayerKind.COPPER:
                message = "two copper layers touch"
                remarks.flaw("SIT009", f"fpc.stackup.{index}", message, "put a dielectric between them")
        return Stackup("written out", tuple(stack), WRITTEN_SOURCE)
    if written is not None:
        return written
    name = _DEFAULT_STACKUP.get(max(coil.layers), _LARGEST_STACKUP)
    remarks.default("fpc.stackup", name, f"the default for {count_text(len(coil.layers), 'coil layer')}")
    return presets.stackup(name)


def _plated_stackup(stackup: Stackup, document: FpcSpec, remarks: Remarks) -> Stackup:
    """Return the stack-up after plating. A single copper layer is not plated.

    If the tail has fewer copper layers than the body, its layers are a core that is plated in a separate step. If the
    spec writes out the stack-up, its copper is finished copper: the foil is the rest without the plating. If the outer
    copper is then too thin for plating, the default is to plate only the holes. If copper contains less than its
    plating, record an error in `remarks` and return the stack-up unchanged.
    """
    written = isinstance(document.values()["stackup"], list)
    count = len(stackup.copper)
    if count < 2:
        for key in ("plating", "plated"):
            if getattr(document, key) is not None:
                remarks.flaw("SIT009", f"fpc.{key}", "one copper layer has no plated holes", "leave it out")
        return stackup
    tail_layers = document.tail.layers if document.tail is not None else None
    core = tail_layers if tail_layers is not None and 1 < tail_layers < count else 0
    wall = document.plating or stackup.plating_thickness or USUAL_PLATING
    is_thin = written and min(stackup.copper[0].thickness, stackup.copper[-1].thickness) <= USUAL_PLATING
    usual = Plating.BUTTONS if is_thin and document.plating is None else stackup.plating
    method = Plating(document.plated or usual)
    built = stackup.built(method, core, wall, finished=written or not stackup.is_plating_stated)
    built = built if written else presets.covered(built)
    if written and document.plating is None:
        part = "in the holes alone" if method is Plating.BUTTONS else "part of the outer copper"
        remarks.default("fpc.plating", show(wall, "m"), part)
    thin = next((layer for layer in built.copper if layer.foil <= ROUNDING), None)
    if thin is None:
        return built
    key = "fpc.plating" if document.plating is not None else "fpc.stackup"
    message = (
        f"copper {thin.number}, {show(thin.thickness, 'm')} finished, contains the plating of {show(thin.plated, 'm')}"
    )
    hint = "write foil and plating together as the copper, or fpc.plated: buttons"
    remarks.flaw("SIT009", key, message, hint, measured=thin.plated, limit=thin.thickness, unit="m")
    return stackup


def _stack_layer(layer: LayerDocument, key: str, remarks: Remarks) -> StackLayer:
    thicknesses = [(kind, getattr(layer, kind)) for kind in ("coverlay", "copper", "dielectric")]
    thicknesses = [(kind, thickness) for kind, thickness in thicknesses if thickness is not None]
    if len(thicknesses) != 1:
        message = "a layer is exactly one of coverlay, copper and dielectric"
        remarks.flaw("SIT009" if thicknesses else "SIT003", key, message, "like {copper: 18 um}")
        return StackLayer(LayerKind.DIELECTRIC, 1e-6, "polyimide", 1.0)
    kind, thickness = LayerKind(thicknesses[0][0]), thicknesses[0][1]
    if layer.adhesive is not None and (kind is not LayerKind.COVERLAY or layer.adhesive >= thickness):
        message = "adhesive is a part of a coverlay's thickness"
        remarks.flaw("SIT009", f"{key}.adhesive", message, "like {coverlay: 37.5 um, adhesive: 25 um}")
        return StackLayer(kind, thickness, "copper" if kind is LayerKind.COPPER else "polyimide", 1.0)
    if kind is LayerKind.COPPER:
        if layer.material is not None or layer.permittivity is not None:
            remarks.flaw("SIT009", key, "copper takes no material and no permittivity", "like {copper: 18 um}")
        return StackLayer(kind, thickness, "copper")
    material = layer.material or ("polyimide-coverlay" if kind is LayerKind.COVERLAY else "polyimide")
    if layer.material is None:
        remarks.default(f"{key}.material", material)
    permittivity = presets.permittivity(material) if layer.permittivity is None else layer.permittivity
    glue = layer.adhesive or 0.0
    made_of = presets.film_text(thickness - glue, glue) if glue else ""
    return StackLayer(kind, thickness, material, permittivity, made_of, adhesive=glue)


def _tail(tail: Tail | None, copper: int, rules: DesignRules, mount: Mount | None, remarks: Remarks) -> Tail | None:
    """Return the tail with all defaults filled in. None if the spec has no tail.

    `copper` is the number of copper layers in the body.
    """
    if tail is None:
        return None
    layers = tail.values()["layers"]
    if layers is None:
        layers = copper
        remarks.default("fpc.tail.layers", str(layers))
    if layers > copper:
        message = f"the tail has {layers} copper layers, the stack-up has {copper}"
        remarks.flaw("SIT009", "fpc.tail.layers", message, "", measured=float(layers), limit=float(copper))
    bend: str | BendDocument = tail.values()["bend"]
    # radius (m) of the inner edge of the tail's turn, at least the fabricator's minimum
    radius, is_turned = tail.values()["turn_radius"], tail.turn != "none" or tail.offset != 0.0
    if tail.turn != "none" and tail.offset:
        message = f"the tail turns {tail.turn} and is led aside too"
        remarks.flaw("SIT009", "fpc.tail.offset", message, "keep one of turn and offset")
    if radius is None:
        radius = max(_TURN_RADIUS, rules.inside_radius)
        if is_turned:
            remarks.default("fpc.tail.turn_radius", show(radius, "m"))
    elif is_turned and radius < rules.inside_radius * (1 - 1e-9):
        message = (
            f"an inner edge of {show(radius, 'm')} radius tears; {rules.holder('inside_radius')} asks "
            f"{show(rules.inside_radius, 'm')}"
        )
        facts = {"measured": radius, "limit": rules.inside_radius, "unit": "m"}
        remarks.flaw("SIT009", "fpc.tail.turn_radius", message, "make it larger", **facts)
    return _bent(replace(tail, layers=layers, turn_radius=radius), bend, mount, remarks)


def _bent(tail: Tail, written: str | BendDocument, mount: Mount | None, remarks: Remarks) -> Tail:
    """Return the tail with its bend. Angle and direction of the bend have defaults.

    `written` is the word or section of the key ``bend`` in the spec. If a jaw has a hinge, the tail bends at the hinge
    into the shaft, by half of the angle between the open jaws. On a finger or a jaw without a hinge, the default angle
    is 0, because the mount itself leads the tail down.
    """
    if written == "none":
        return replace(tail, bend="none")
    angle, why = tail.bend_angle, "the default of a bend whose angle is not said"
    jaw = mount.jaw if mount is not None else None
    if mount is not None and mount.finger is not None:
        angle, why = 0.0, "the cap lets the tail down to the finger, and it is bent no farther"
    if jaw is not None:
        angle, why = 0.0, "the mount lets the tail down to the jaw; where it goes on is not known (mount.jaw.hinge)"
        if jaw.hinge is not None and jaw.opening:
            angle, why = jaw.opening / 2, "into the shaft when the jaws are wide open: half of their opening"
    if isinstance(written, BendDocument):
        tail = replace(
            tail, bend=written.kind, bend_at=written.at, bend_direction=written.direction, bend_radius=written.radius
        )
        if written.angle is not None:
            return replace(tail, bend_angle=written.angle)
    else:
        tail = replace(tail, bend=written)
    remarks.default("fpc.tail.bend.angle", f"{math.degrees(angle):.4g} deg {tail.bend_direction}", why)
    return replace(tail, bend_angle=angle)
