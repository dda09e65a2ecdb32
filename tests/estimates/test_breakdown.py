"""What the terminal inductance is made of: parts that add up and are booked where the copper lies."""

from __future__ import annotations

import json
import math

import pytest
from tolerance import approx

from sitscad.basics.units import quantity
from sitscad.estimates import estimate
from sitscad.estimates.coil_estimates import PARTS
from sitscad.files.report import numbers
from sitscad.layout import lay_out
from sitscad.layout.board import Role, Trace
from sitscad.spec.load import load, load_text

RACETRACK = """
sitscad: 1
name: long
coil: {shape: racetrack, outer_diameter: [14, 7], turns: TURNS, layers: 2, trace_width: WIDTH, trace_spacing: 100 um}
fpc: {stackup: flex-2l-35um, tail: {length: 30, connector: zif-0.5mm, layers: 2, bend: static}}
"""


def of(text):
    """The estimate of a spec's text, and its layout."""
    layout = lay_out(load_text(text, "long.yaml"))
    return estimate(layout), layout


def nanohenries(cell):
    """The number in a cell of the table."""
    number, unit = cell.split()
    assert unit == "nH"
    return float(number)


def test_inductance_parts_add_up_to_terminal_inductance(template):
    layout = lay_out(load(template))
    result = estimate(layout)
    (frequency, *rows, total) = numbers.part_table(result.coils).rows
    assert "frequency" in frequency[0] and "sum" in total[0] and len(rows) == len(PARTS)
    for column, (coil, drawn) in enumerate(zip(result.coils, layout.coils, strict=True), start=1):
        free = coil.states["free"]
        assert tuple(coil.inductance_parts) == PARTS
        assert math.fsum(coil.inductance_parts.values()) == approx(free.inductance, rel=1e-12)
        assert coil.terminal_inductance == free.inductance
        assert frequency[column] == quantity(free.frequency, "Hz")
        # as printed, to what rounding of nine rows leaves
        printed = [nanohenries(row[column]) for row in rows]
        assert math.fsum(printed) == approx(nanohenries(total[column]), abs=0.05)
        assert coil.inductance_parts["winding"] == coil.winding_inductance
        assert coil.inductance_parts["bends"] == coil.bend_inductance < 0.0
        assert coil.inductance_parts["crowding"] < 0.0
        parts = {name: coil.inductance_parts[name] for name in coil.lead_parts}
        assert parts == coil.lead_parts and math.fsum(parts.values()) == approx(coil.lead_inductance, rel=1e-6)
        tracks = [t for t in drawn.series if isinstance(t, Trace)]
        assert any(t.role is Role.TAIL for t in tracks) and coil.inductance_parts["tail"] > 0.5e-9


def test_crowding_part_equals_inductance_change_of_winding_loss():
    """It is taken as what is left of the interpolated terminal value; the modes of the tracks say the same."""
    from sitscad.estimates.windings.losses import winding_losses
    from sitscad.estimates.windings.methods import winding_geometry
    from sitscad.kernels.electromagnetics.loss.resistance import conductivity_at
    from tests.oracles.losses import inductance_change

    result, layout = of(RACETRACK.replace("TURNS", "6.5").replace("WIDTH", "200 um"))
    coil, spec = result.coils[0], layout.spec
    geometry = winding_geometry(spec.coil, layout.coils[0])
    loss = winding_losses(spec.coil, layout.coils[0], geometry.spirals, conductivity_at(20.0), None)
    crowding = inductance_change(loss, coil.sensor_frequency) - loss.direct_change
    assert coil.inductance_parts["crowding"] == approx(crowding, abs=3e-5 * coil.terminal_inductance)
    assert crowding < -1e-3 * coil.terminal_inductance


@pytest.mark.parametrize(("turns", "width"), [("6.5", "100 um"), ("4.5", "300 um")])
def test_tail_inductance_part_is_independent_of_track_width(turns, width):
    """Tracks of the tail no wider than the coil's were booked as leads on the body, and the tail read 0 H."""
    result, layout = of(RACETRACK.replace("TURNS", turns).replace("WIDTH", width))
    parts = result.coils[0].inductance_parts
    assert 5e-9 < parts["tail"] < 9e-9
    end = layout.body_size[0] / 2.0
    for trace in layout.coils[0].series:
        if isinstance(trace, Trace) and trace.role is Role.TAIL:
            assert min(trace.path.start.x, trace.path.end.x) > end


def test_missing_lead_room_gives_incomplete_layout_note_first():
    text = RACETRACK.replace("TURNS", "16.5").replace("WIDTH", "100 um")
    result, layout = of(text)
    assert layout.shortfalls and result.incomplete.startswith("INCOMPLETE LAYOUT: C1")
    shown = numbers.estimate_text("long.yaml", result, None)
    assert shown.splitlines()[2].startswith("INCOMPLETE LAYOUT")
    assert shown.count("INCOMPLETE") == 1
    assert result.as_json("long.yaml")["incomplete"] == result.incomplete == result.notes[0]
    whole = of(RACETRACK.replace("TURNS", "6.5").replace("WIDTH", "100 um"))[0]
    assert whole.as_json("long.yaml")["incomplete"] is None
    json.dumps(result.as_json("long.yaml"), allow_nan=False)


def test_missing_closed_formula_gives_reason():
    result, _ = of(RACETRACK.replace("TURNS", "6.5").replace("WIDTH", "100 um"))
    ((_, formula, *_, reason),) = numbers.cross_check_table(result.cross_checks, result.no_cross_check).rows
    assert formula == "none" and "racetrack" in reason and "Mohan" in reason
    assert result.as_json("x")["no_cross_check"] == reason
    unequal = RACETRACK.replace("racetrack", "circle").replace("[14, 7]", "7").replace("TURNS", "[8, 7]")
    assert "one number of turns" in of(unequal.replace("WIDTH", "100 um"))[0].no_cross_check
    assert of(unequal.replace("[8, 7]", "8").replace("WIDTH", "100 um"))[0].no_cross_check is None


def test_json_contains_channel_of_every_coil():
    text = RACETRACK.replace("TURNS", "6.5").replace("WIDTH", "100 um")
    (coil,) = of(text)[0].as_json("x")["coils"]
    assert (coil["converter"], coil["channel"], coil["i2c_address"]) == (0, 0, 0x2A)
