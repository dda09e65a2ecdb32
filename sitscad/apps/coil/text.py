"""The figures of a spiral as text for people and as JSON for programs. A new format is one function and one row."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from sitscad.apps.coil.drawn import DrawnCoil
from sitscad.apps.coil.spiral import Spiral, lumped_limit
from sitscad.basics.quantities import (
    DRAWN_COIL,
    DRAWN_COIL_AT_FREQUENCY,
    LONE_COIL,
    LONE_COIL_AT_FREQUENCY,
    Table,
    by_quantity,
    by_result,
)
from sitscad.basics.units import count_text, escape_controls, quantity, show
from sitscad.checks.findings import styled, to_json
from sitscad.files.report.numbers import table_text


def as_text(spiral: Spiral, colour: bool = False) -> str:
    """Return the dimensions, the figures with their errors, and closed formulas of other authors beside them."""
    coil = spiral.coil
    outer, inner = (" x ".join(show(each, "m") for each in sorted(set(size), reverse=True))
                    for size in (coil.size, coil.inner_size))
    layers = f"{len(coil.layers)} layer{'s in series' if len(coil.layers) > 1 else ''}"
    lines = (
        f"{coil.shape}, {coil.turns_in_words} turns, {layers}, {outer} outside, {inner} inside",
        f"tracks {show(coil.trace_width, 'm')}, gaps {show(coil.trace_spacing, 'm')}, stack-up {spiral.stackup}, "
        f"{spiral.temperature:g} C; without leads, no metal near",
    )
    notes = ["Q and Rp are those of the coil with a lossless capacitor; an LCR meter also sees the coil's capacitance"]
    rows = by_quantity([spiral], LONE_COIL)
    if spiral.self_resonance is None:
        limit = show(lumped_limit(spiral.layout.coils[0]), "Hz", 2)
        rows = [row for row in rows if not row[0].startswith("self-resonance")]
        rows.append(["self-resonance", f"above {limit}, where the track is a tenth of a wavelength"])
    tables = (
        by_result(spiral.at, LONE_COIL_AT_FREQUENCY)._replace(notes=notes),
        Table(("", ""), rows, "At every frequency"),
        formula_table(spiral),
    )
    return _joined("\n".join((styled(lines[0], "bold", colour), lines[1])), "", tables, colour)


def formula_table(spiral: Spiral) -> Table:
    """Return closed formulas of other authors, for an inductance without crowding of the current."""
    title = "Closed formulas (Mohan 1999), to compare with"
    if spiral.no_formula:
        return Table((), [[spiral.no_formula]], title)
    rows = [[each.method, quantity(each.inductance, "H"), f"{100.0 * each.deviation:+.1f} %",
             "yes" if each.is_valid else "no", each.validity] for each in spiral.formulas]
    return Table(("formula", "inductance", "against ours", "in its range", "range"), rows, title)


def drawn_as_text(coil: DrawnCoil, colour: bool = False) -> str:
    """Return the conductor that was followed, remarks on it, and its figures."""
    conductor = coil.conductor
    vias = count_text(len(conductor.vias), "via")
    runs = [[layer, f"{turns:+.2f}"] for layer, turns in conductor.turns()]
    first = f"from {conductor.ends[0]} to {conductor.ends[1]}: {vias}, tracks {show(conductor.width, 'm')}, "
    first += f"stack-up {coil.stackup or 'of the board'}"
    remarks = "\n".join(styled(f"note: {escape_controls(note)}", "yellow", colour) for note in coil.notes)
    tables = (
        Table(("layer", "turns"), runs, notes=["counter-clockwise positive, seen from the top, along the current"]),
        by_result(coil.at, DRAWN_COIL_AT_FREQUENCY)._replace(notes=[
            "the coil's own capacitance is not computed: the figures hold far below its self-resonance"]),
        Table(("", ""), by_quantity([coil], DRAWN_COIL), f"At {coil.temperature:g} C"),
    )
    return _joined(styled(escape_controls(first), "bold", colour), remarks, tables, colour)


def _joined(title: str, remarks: str, tables: Sequence[Table], colour: bool) -> str:
    """Return a title, remarks if there are any, and tables with empty lines between them."""
    blocks = [title, *([remarks] if remarks else []), *(table_text(table, colour) for table in tables)]
    return "\n\n".join(blocks) + "\n"


def as_json(coil: Spiral | DrawnCoil, colour: bool = False) -> str:
    """Return the JSON document of ``sitscad coil``."""
    return to_json(coil.document())


DRAWN_COIL_FORMATS: Mapping[str, Callable[[DrawnCoil, bool], str]] = {"text": drawn_as_text, "json": as_json}
"""Output formats of ``sitscad coil FILE``."""

COIL_FORMATS: Mapping[str, Callable[[Spiral, bool], str]] = {"text": as_text, "json": as_json}
"""Output formats of ``sitscad coil``."""
