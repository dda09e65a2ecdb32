"""What a finding about room advises: the change that it names was tried, and the board laid out, before it says so."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace

from sitscad.finding import Finding
from sitscad.layout import remedies
from sitscad.layout.clearance import hole_keep_out, joined_hole
from sitscad.spec.presets import connector, names
from sitscad.spec.sensor import SensorSpec


def with_remedy(spec: SensorSpec, finding: Finding, left: Callable[[SensorSpec], set[str] | None]) -> Finding:
    """A finding with what mends it, where trying finds it.

    `left` lays a changed spec out and names the rules that it still breaks, None where there is no time for it.
    """
    mend, may_stay = _MENDS.get(finding.rule, (None, set()))
    if mend is None:
        return finding

    def works(changed: SensorSpec) -> bool:
        broken = left(changed)
        return broken is not None and broken <= may_stay

    return mend(spec, finding, works)


def remedy(spec: SensorSpec, finding: Finding) -> SensorSpec | None:
    """The spec with what a finding about room says was tried, read back from it; None where it names nothing."""
    if "it was tried" not in finding.hint:
        return None
    missing = (finding.limit or 0.0) - (finding.measured or 0.0)
    if finding.rule == "SIT112":
        return remedies.wider_coil(spec, missing)
    if finding.rule == "SIT119" and spec.fpc.tail is not None:
        name = next(name for name in names("connector") if f"connector: {name} " in finding.hint)
        return replace(spec, fpc=replace(spec.fpc, tail=replace(spec.fpc.tail, connector=connector(name))))
    changed = remedies.wider_array(spec, missing) if missing > 0.0 else spec
    turned = re.search(r"coil\.start_angle: ([\d.]+) deg", finding.hint)
    if turned:
        changed = replace(changed, coil=replace(changed.coil, start_angle=math.radians(float(turned[1]))))
    return changed


def _wider_inside(spec: SensorSpec, finding: Finding, routes: remedies.Works) -> Finding:
    assert finding.measured is not None and finding.limit is not None
    first = max(finding.limit - finding.measured, 0.5 * spec.fpc.rules.via_pad)
    more = remedies.least(spec, remedies.wider_coil, remedies.inner_vias_fit, first)
    if more is None:
        return finding
    with_pitch = ", and the coils as much farther apart" if len(spec.array.placements) > 1 else ""
    return replace(
        finding,
        message=f"{finding.message}: {more * 1e6:.0f} um are missing",
        hint=f"an outer diameter larger by {more * 1e6:.0f} um makes room (it was tried){with_pitch}; "
        f"or {finding.hint}",
        limit=finding.measured + more,
    )


def _wider_between(spec: SensorSpec, finding: Finding, routes: remedies.Works) -> Finding:
    near, first = remedies.nearest_distance(spec), lead_room(spec)
    more = None if near is None else remedies.least(spec, remedies.wider_array, routes, first)
    if near is not None and more is not None:
        wider = f"{_wider(spec, near, more)} lets them pass (it was tried), or perhaps another coil.start_angle"
        return _too_near(spec, finding, near, more, wider)
    angle = remedies.start_angle(spec, routes)
    if angle is not None:
        return replace(finding, hint=f"{_start_at(angle)} gives them one (it was tried)")
    if near is None:
        return finding
    more = remedies.GROWTH * first
    angle = remedies.start_angle(remedies.wider_array(spec, more), routes)
    if angle is None:
        return finding
    both = f"{_wider(spec, near, more)} together with {_start_at(angle)} lets them pass (it was tried)"
    return _too_near(spec, finding, near, more, both)


def _start_at(angle: float) -> str:
    return f"coil.start_angle: {math.degrees(angle):.6g} deg"


def _wider(spec: SensorSpec, near: float, more: float) -> str:
    if spec.array.pattern == "explicit":
        return f"centres {1.0 + more / near:.4f} times as far from each other"
    return f"a pitch larger by {more * 1e6:.0f} um"


def _too_near(spec: SensorSpec, finding: Finding, near: float, more: float, hint: str) -> Finding:
    return replace(
        finding,
        message=f"leads and outer vias find no room between the coils, whose centres are {near * 1e3:.3f} mm apart: "
        f"{more * 1e6:.0f} um are missing",
        hint=hint,
        key="array.centres" if spec.array.pattern == "explicit" else "array.pitch",
        measured=near,
        limit=near + more,
        unit="m",
    )


def lead_room(spec: SensorSpec) -> float:
    """What a via and a lead want beyond the gap between two coils (m), a track's pitch at least."""
    rules, pitch = spec.fpc.rules, spec.coil.trace_width + spec.fpc.rules.trace_spacing
    hole = joined_hole(rules, spec.coil.trace_width)
    gap = (remedies.nearest_distance(spec) or 0.0) - spec.coil.size[0]
    return max(2.0 * hole_keep_out(hole, rules, rules.trace_spacing) + pitch - gap, pitch)


def _wider_contacts(spec: SensorSpec, finding: Finding, routes: remedies.Works) -> Finding:
    name = remedies.other_connector(spec, routes)
    if name is None:
        return finding
    missing = connector(name).pitch - (finding.measured or 0.0)
    return replace(
        finding,
        hint=f"fpc.tail.connector: {name} gives them room (it was tried): {missing * 1e6:.0f} um more from contact to "
        "contact; or fewer coils on one tail",
        limit=connector(name).pitch,
    )


_MENDS: dict[str, tuple[Callable[[SensorSpec, Finding, remedies.Works], Finding], set[str]]] = {
    "SIT112": (_wider_inside, set()),
    "SIT113": (_wider_between, {"SIT119"}),  # contacts too near each other are a finding of their own
    "SIT119": (_wider_contacts, set()),
}
"""What mends a finding, and which rules may then still be broken."""
