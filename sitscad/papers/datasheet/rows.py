"""The data sheet's tables, each a heading and rows of texts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from sitscad.calibration.calibrate import AXIS_WORDS, Calibration
from sitscad.calibration.working_range import working_range
from sitscad.estimates.performance.bench import held_shear
from sitscad.estimates.performance.reach import INSTABILITY
from sitscad.estimates.performance.values import AxisPerformance, Performance, largest_lasting
from sitscad.estimates.values import Estimates
from sitscad.geometry.shapes import PLATES
from sitscad.layout.board import Layout
from sitscad.layout.tail_tracks import contacts, head
from sitscad.spec.plates import ElastomerPad, Target
from sitscad.units import show

Rows = list[tuple[str, ...]]

NAMES = AXIS_WORDS


def summary(felt: Sequence[Performance], layout: Layout) -> Rows:
    """What every axis can do."""
    rest, half, full = felt
    names = list(full.axes)
    rows: Rows = [("characteristic", *(NAMES[name] for name in names))]

    def row(what: str, *texts: str) -> None:
        rows.append((what, *texts))

    axes, held = [full.axes[name] for name in names], held_shear(layout.spec)
    row("full scale", *(_newtons(axis.full_scale) for axis in axes))
    together = working_range(layout.spec)
    if together.is_round:
        limit = _newtons(together.shear)
        row("calibrated for both shears together up to", *(NONE if name == "normal" else limit for name in names))
    row("range, kept level, and what ends it", *(f"{_newtons(axis.range)}, {axis.limited_by}" for axis in axes))
    if any(max(full.axes[name].full_scale, full.axes[name].range) > held for name in names if name != "normal"):
        row("extrapolated by the pad's law beyond", *(NONE if name == "normal" else _newtons(held) for name in names))
    for point in (rest, half, full):
        row(f"resolution {point.at}: the noise alone", *(_newtons(point.axes[name].resolution) for name in names))
    lasting = [largest_lasting(axis.errors) for axis in axes]
    row("largest error that lasts, full load", *(f"{_newtons(error)}, {cause}" for error, cause in lasting))
    row("largest sensitivity of a coil at half load", *(_sensitivity(half.axes[name]) for name in names))
    row("nonlinearity, straight map", *(_share(half.axes[name].nonlinearity) for name in names))
    row("crosstalk, straight map", *(_crosstalk(half.straight_crosstalk, name) for name in names))
    row("crosstalk, curved map, of this design as drawn", *(_crosstalk(half.crosstalk, name) for name in names))
    for angle in ("rx", "ry"):
        row(f"error by {_degrees(full.tilt)} of {angle}, either way",
            *(_newtons(full.tilt_error[name][angle]) for name in names))  # fmt: skip
    row("error by a force 0.1 mm beside", *(_newtons(full.axes[name].errors[BESIDE]) for name in names))
    row("drift after the tare, a kelvin, full load", *(_newtons(full.temperature_error[name]) for name in names))
    return rows


NONE = "-"
"""In place of a figure that there is not."""

LEAST_TOLD = 1e-4
"""Crosstalk of a noiseless map below which its digits mean nothing."""

BESIDE = "contact 0.1 mm beside the middle"


def sensor(felt: Sequence[Performance], layout: Layout, estimates: Estimates) -> Rows:
    """What belongs to the sensor as a whole."""
    full, readout, pad, target = felt[-1], estimates.readout, layout.spec.elastomer, layout.spec.target
    assert pad is not None and target is not None
    friction = (
        "-"
        if full.friction_error is None or not math.isfinite(full.friction_error)
        else f"+-{full.friction_error:.2g} (one sigma)"
    )
    return [
        ("sensor", ""),
        *_overloads(full),
        ("error of shear over normal, full load", friction),
        (f"bandwidth ({full.bandwidth_by})", show(full.bandwidth, "Hz", 3)),
        ("resonance of target and pad, nothing on it", _resonances(full)),
        ("condition number, rest to full load", f"{felt[0].condition_number:.2g} to {full.condition_number:.2g}"),
        ("one load to a reading", "yes" if full.invertible else "NO: see the notes"),
        ("converter", f"{readout.device.part}, {len(estimates.coils)} channel{'s' * (len(estimates.coils) > 1)}"),
        *([("its result", readout.result_in_words)] if readout.result_in_words else []),
        ("tank capacitor", show(readout.capacitance, "F", 3)),
        ("target", f"{target.material.name}, {_size(target)}, {show(target.thickness, 'm')}"),
        ("elastomer", f"{pad.material.name}, {_size(pad)}, {show(pad.thickness, 'm')}"),
        ("shear modulus of it", f"{show(pad.material.shear_modulus, 'Pa', 3)} +- "
                                f"{100.0 * pad.material.shear_modulus_sigma:.0f} %"),
    ]  # fmt: skip


def _overloads(full: Performance) -> Rows:
    """The normal force that the target bears, and how it is held where that matters."""
    gives_way = full.axes["normal"].limited_by == INSTABILITY
    ends = SIDEWAYS if gives_way else "30 % strain of the pad"
    if full.free_overload is None:
        return [(f"overload ({ends})", _newtons(full.overload))]
    return [(f"overload, kept level ({ends})", _newtons(full.overload)),
            (f"overload, free to tilt ({SIDEWAYS})", _newtons(full.free_overload))]  # fmt: skip


SIDEWAYS = "the pad gives way sideways"
"""Why a normal force is too large before the pad is strained too far."""


def _resonances(full: Performance) -> str:
    """By axis in words, a dash where no density is known."""
    return ", ".join(f"{show(value, 'Hz', 2)} {NAMES[name]}" for name, value in full.resonance.items()) or "-"


FROM_UNIT_TO_UNIT = ("modulus, before calibration", "manufacture, before calibration", "manufacture, after calibration")
"""Causes that differ between units: the paper has them as a calibration has them."""


def errors(felt: Sequence[Performance]) -> Rows:
    """One sigma by cause at full load, of every unit alike."""
    full = felt[-1]
    names = list(full.axes)
    rows: Rows = [("one sigma of error at full load, any unit, by cause", *(NAMES[name] for name in names))]
    for cause in full.axes[names[0]].errors:
        if cause in FROM_UNIT_TO_UNIT:
            continue
        rows.append((cause, *(_newtons(full.axes[name].errors[cause]) for name in names)))
    return rows


def from_unit_to_unit(found: Calibration | None) -> Rows:
    """What forces are off by on any unit, and on one that is calibrated: as calibration/ states it."""
    return [] if found is None else list(found.error_rows)


def drift(felt: Sequence[Performance]) -> Rows:
    """What a kelvin does, by what warms, with its sign where that is known."""
    full = felt[-1]
    names = list(full.axes)
    rows: Rows = [("by a kelvin after the tare", *(NAMES[name] for name in names))]
    for cause, row in full.temperature_causes.items():
        sign = "+-" if cause == "capacitors" else ""
        rows.append((cause, *(sign + _newtons(row[name]) for name in names)))
    return rows


def production(felt: Sequence[Performance]) -> Rows:
    """Between which limits a bare coil is sound."""
    rows: Rows = [("bare coil, before assembly", "L from", "L to", "f from", "f to")]
    for coil, limits in felt[0].production.items():
        low, high = (show(limits[f"inductance_{end}_H"], "H", 4) for end in ("min", "max"))
        slow, fast = (show(limits[f"frequency_{end}_Hz"], "Hz", 4) for end in ("min", "max"))
        rows.append((coil, low, high, slow, fast))
    return rows


def incoming(bench: Estimates) -> Rows:
    """What a usual meter reads of the bare board at 20 degrees Celsius; nothing where no coil was asked."""
    if not bench.metered:
        return []
    at = show(bench.metered[0].frequency, "Hz")
    rows: Rows = [("bare coil, on an LCR meter", f"L at {at}", f"R at {at}", "R, direct current")]
    for read in bench.metered:
        pairs = ((read.inductance, read.inductance_sigma, "H"), (read.resistance, read.resistance_sigma, "ohm"),
                 (read.direct, read.direct_sigma, "ohm"))  # fmt: skip
        rows.append((read.coil, *(f"{show(value, unit, 4)} +- {show(sigma, unit, 2)}" for value, sigma, unit in pairs)))
    return rows


def pinning(layout: Layout) -> Rows:
    """Where every contact leads."""
    found = contacts(layout)
    return [head(layout.spec.readout.device.part), *(contact.cells for contact in found)] if found else []


def notes(felt: Sequence[Performance], found: Calibration | None = None) -> Iterator[str]:
    """What to know before the figures are used."""
    full = felt[-1]
    yield "Computed, not measured. Every figure is of this design; a unit is as good as its own calibration makes it."
    if full.ambiguous is not None:
        one, other = (", ".join(_newtons(force) for force in load) for load in full.ambiguous)
        yield f"Two loads (normal, shear along x, along y) read alike: {one}; and {other}. No map tells them apart."
    said = [*full.notes, *(found.sensors.range.notes if found is not None else ()),
            *(f"the map in calibration/ is {note}" for note in (found.notes if found is not None else ())
              if note.startswith("made for"))]  # fmt: skip
    yield from (note[0].upper() + note[1:] for note in dict.fromkeys(said))


def _degrees(angle: float) -> str:
    degrees = f"{math.degrees(angle):.3g}"
    return "one degree" if degrees == "1" else f"{degrees} degrees"


def _newtons(force: float) -> str:
    if math.isinf(force):
        return "no reading tells it"
    return show(force, "N", 3) if abs(force) >= 1e-6 else "0 N"


def _share(part: float) -> str:
    return f"{100.0 * part:.0f} %" if part >= 0.1 else f"{100.0 * part:.2g} %"


def _crosstalk(table: object, name: str) -> str:
    row = table[name]  # type: ignore[index]
    if not row:
        return "-"
    worst = max(row.values())
    return _share(worst) if worst >= LEAST_TOLD else f"below {_share(LEAST_TOLD)}"


def _sensitivity(axis: AxisPerformance) -> str:
    return f"{show(max(map(abs, axis.sensitivity)), 'Hz', 3)}/N"


def _size(plate: Target | ElastomerPad) -> str:
    return f"{PLATES[plate.shape].size_in_words(plate.size)} mm"
