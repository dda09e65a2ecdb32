"""The written load cases to `LoadCase` values."""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.spec.format.documents.loads import MechanismDocument
from sitscad.spec.format.documents.spec import SpecDocument
from sitscad.spec.format.remarks import Remarks
from sitscad.spec.pieces.loads import LoadCase, Mechanism
from sitscad.spec.pieces.mounting import Mount
from sitscad.units import show


def resolve_loads(document: SpecDocument, mount: Mount | None, remarks: Remarks) -> tuple[LoadCase, ...]:
    """The load cases in the order of the format; a flaw each for those that lack a force, a pad or a lever."""
    cases = tuple(_cases(document, mount, remarks))
    for case in cases:
        if document.elastomer is None or document.target is None:
            remarks.flaw("SIT009", f"loads.{case.name}", "a load needs a target on an elastomer",
                         "write target and elastomer, or leave the load case out")  # fmt: skip
    return cases


def _cases(document: SpecDocument, mount: Mount | None, remarks: Remarks) -> Iterator[LoadCase]:
    """The ways in which the sensor is pushed, one a section that is there."""
    loads = document.loads
    if loads.press is not None:
        yield LoadCase("press", _normal(document, "press", loads.press.normal, remarks))
    if loads.shear is not None:
        one = loads.shear
        normal = _normal(document, "shear", one.normal, remarks)
        yield LoadCase("shear", normal, (one.shear_x, one.shear_y), is_held=one.rotation == "held")
    if loads.scissor is not None:
        normal = _normal(document, "scissor", loads.scissor.normal, remarks)
        yield LoadCase("scissor", normal, opening=loads.scissor.opening, is_stuck=loads.scissor.face == "sticks")
    if loads.edge is not None:
        normal = _normal(document, "edge", loads.edge.normal, remarks)
        _check_edge(document, loads.edge.offset, remarks)
        yield LoadCase("edge", normal, offset=loads.edge.offset, is_held=False)
    if loads.mechanism is not None:
        mechanism = _mechanism(loads.mechanism, mount, remarks)
        yield LoadCase("mechanism", None, opening=2.0 * loads.mechanism.theta, is_stuck=True, mechanism=mechanism)


def _normal(document: SpecDocument, name: str, written: float | None, remarks: Remarks) -> float:
    """The normal force (N): what is written, or the required one."""
    required = document.requirements.normal_force
    if written is None and required is None:
        remarks.flaw("SIT009", f"loads.{name}", "no normal force is given, and none is required",
                     f"write loads.{name}.normal, or requirements.normal_force")  # fmt: skip
    elif written is None:
        remarks.default(f"loads.{name}.normal", show(required or 0.0, "N"), "the required normal force")
    return (written if written is not None else required) or 0.0


def _check_edge(document: SpecDocument, offset: tuple[float, float], remarks: Remarks) -> None:
    """A flaw for a force that acts beside the target."""
    target = document.target
    if target is None or target.size is None:
        return
    half = 0.5 * math.hypot(*target.size)
    if math.hypot(*offset) > half:
        remarks.flaw("SIT009", "loads.edge.offset", f"{show(math.hypot(*offset), 'm')} from the middle of a "
                     f"target that reaches {show(half, 'm')}", "write an offset on the target")  # fmt: skip


def _mechanism(written: MechanismDocument, mount: Mount | None, remarks: Remarks) -> Mechanism:
    """The levers; a flaw where link B cannot reach the axis, or nothing says how long the jaw is."""
    lever_angle = written.theta + written.theta0
    aside = written.LA * math.sin(lever_angle)
    if aside >= written.LB:
        remarks.flaw("SIT009", "loads.mechanism.LB", f"link B, {show(written.LB, 'm')}, does not reach the axis from "
                     f"lever A's pin, {show(aside, 'm')} beside it", f"more than {show(aside, 'm')}")  # fmt: skip
    if lever_angle <= 0.0:
        remarks.flaw("SIT009", "loads.mechanism.theta", "lever A would lie along the axis, where no pull closes "
                     "the jaws", "theta and theta0 together above 0 deg")  # fmt: skip
    reach = written.LJ
    if reach is None and mount is not None and mount.jaw is not None and mount.jaw.hinge is not None:
        reach = mount.jaw.hinge + mount.jaw.length
        remarks.default("loads.mechanism.LJ", show(reach, "m"), "from the pivot to the tip of mount.jaw")
    elif reach is None:
        remarks.flaw("SIT009", "loads.mechanism.LJ", "nothing says how far from the pivot the jaw presses",
                     "write loads.mechanism.LJ, like 28 mm")  # fmt: skip
    return Mechanism(written.shaft_tension, written.theta, written.theta0, written.LA, written.LB, reach or 1.0)
