"""Calibration reports and plans: a page and text on the fit, and the table and instructions for the bench.

The reports have the errors, the unknowns with their changes by the fit, and each point with its residuals.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from html import escape

import numpy as np

from sitscad.assembly.places.bodies import plates_of
from sitscad.assembly.places.motions import ROTATIONS
from sitscad.assembly.places.seating import metal_free_distance
from sitscad.basics.arrays import Array
from sitscad.basics.units import escape_controls, in_mm, quantity, show
from sitscad.calibration.calibration import Calibration
from sitscad.calibration.drift_fit import DriftFit
from sitscad.calibration.misfit import UNUSUAL
from sitscad.calibration.points import Plan, load_instruction, load_place, table_head
from sitscad.calibration.unknowns import usual_value
from sitscad.estimates.performance.compensation import CAPACITORS
from sitscad.estimates.performance_values import SHOWN, amount_text, display_factors, load_unit
from sitscad.files.drawing.sheet import Pen, Sheet
from sitscad.files.drawing.svg import svg
from sitscad.files.drawing.web_page import html_page, soft_paragraph
from sitscad.files.report.numbers import aligned_table, head_and_rows, html_table
from sitscad.kernels.geometry.path import Point, circle
from sitscad.spec.coil import CoilSpec
from sitscad.spec.mount import Mount

MOVED_HEAD = ("unknown", "found", "+-", "usual scatter", "moved by")


def unknown_rows(calibration: Calibration) -> Iterable[tuple[str, ...]]:
    """Yield a row per unknown: name, fitted value, its sigma, sigma before the fit, and change by the fit in sigmas."""
    units = {unknown.name: unknown.unit for unknown in calibration.sensors.unknowns}
    for name, row in calibration.moved.items():
        yield (name, *(_amount_text(row[key], units[name]) for key in ("value", "sigma", "sigma_before")),
               f"{row['moved_by_sigmas']:+.1f} sigma")


def _amount_text(value: float, unit: str) -> str:
    if unit == "1":
        return f"{100.0 * value:.2g} %"
    return f"{np.degrees(value):.2g} deg" if unit == "rad" else quantity(value, unit, 2)


def point_rows(calibration: Calibration) -> tuple[list[str], list[list[str]]]:
    """Return headings and rows of the points: number, loads, errors of the map, errors of a fit without the point.

    An error is the force computed from the readings minus the applied load. Empty for points that state poses and no
    loads.
    """
    points, fit = calibration.points, calibration.fit
    if points is None or points.loads is None or fit is None or fit.force_errors is None:
        return [], []
    settled, columns, axes = points.without_drift, calibration.sensors.range.columns, calibration.map.axes
    read = calibration.map(settled.frequency, settled.rest)
    head = ["point", *(f"{name} {SHOWN[load_unit(name)][1]}" for name in axes), *(f"read {name}" for name in axes),
            *(f"foretold {name}" for name in axes)]
    rows, scale = [], display_factors(axes)
    numbers = np.cumsum(~points.at_rest)  # tares are not counted, as in figure and plan
    for k, (load, force, alone) in enumerate(zip(points.loads[:, columns], read, fit.force_errors, strict=True)):
        foretold = ["-"] * len(axes) if points.at_rest[k] else [f"{error:+.3f}" for error in scale * alone]
        rows.append(["tare" if points.at_rest[k] else str(numbers[k]), *(f"{value:.3f}" for value in scale * load),
                     *(f"{off:+.3f}" for off in scale * (force - load)), *foretold])
    return head, rows


DRIFT_HEAD = ("cause of drift", "measured", "+-", "usual scatter")


def drift_rows(drift: DriftFit) -> Iterable[tuple[str, ...]]:
    """Yield a row per unknown of the drift: name, fitted value, its sigma, and its sigma before the fit."""
    for name, values in drift.moved.items():
        is_capacitor = name.startswith(CAPACITORS)
        yield (name, *(f"{1e6 * value:.3g} ppm/K" if is_capacitor else f"{100.0 * value:.3g} %" for value in values))


def drift_fit_text(drift: DriftFit, axes: Sequence[str]) -> str:
    """Describe the fit of the drift: its range, its chi-square, its worst row, and the drift that it leaves."""
    left = ", ".join(f"{name} {amount_text(error, name, 2)}"
                     for name, error in zip(axes, drift.error(drift.span), strict=True))
    return (f"Drift measured over {drift.span:.3g} K, in per cent of the design: chi-square {drift.chi_square:.3g} of "
            f"{drift.free} readings. The worst row is line {drift.lines[drift.worst]}, "
            f"{max(drift.disagreement[drift.worst], 0.0):.1f} sigma beside the others. At full load the compensation "
            f"leaves (one sigma): {left}.")


def temperature_rows(calibration: Calibration, drift: DriftFit) -> tuple[list[str], list[list[str]]]:
    """Return headings and rows at further temperatures: line, temperature, loads, errors without and with compensation.

    An error is the force computed from the readings minus the applied load.
    """
    columns, axes = calibration.sensors.range.columns, calibration.map.axes
    scale, loads = display_factors(axes), drift.loads[:, columns]
    head = ["line", "degC", *(f"{name} {SHOWN[load_unit(name)][1]}" for name in axes),
            *(f"{name} {way}" for way in ("drifted", "compensated") for name in axes)]
    rows = [[str(line), f"{celsius:.4g}", *(f"{force:.3f}" for force in scale * load),
             *(f"{error:+.3f}" for forces in (drifted, compensated) for error in scale * (forces - load))]
            for line, celsius, load, drifted, compensated in zip(
                drift.lines, drift.celsius, loads, drift.without, drift.compensated, strict=True)]
    return head, rows


def calibration_text(calibration: Calibration) -> str:
    """Return the calibration in few lines, for a terminal."""
    what = "Calibrated by its points" if calibration.fit is not None else "As drawn, after a tare: not calibrated"
    lines = [f"{what}: {calibration.map.form}", *aligned_table(*head_and_rows(calibration.error_rows)), "",
             calibration.errors_are]
    if calibration.fit is not None:
        lines += ["", *aligned_table(MOVED_HEAD, unknown_rows(calibration))]
        unusual = [name for name, row in calibration.moved.items() if abs(row["moved_by_sigmas"]) > UNUSUAL]
        if unusual:
            lines += ["", f"unusual for this design: {', '.join(unusual)}"]
    if calibration.drift is not None:
        lines += ["", drift_fit_text(calibration.drift, calibration.map.axes),
                  *aligned_table(DRIFT_HEAD, drift_rows(calibration.drift)), "",
                  *aligned_table(*temperature_rows(calibration, calibration.drift))]
    if calibration.plan is not None:
        warm = "" if calibration.temperatures is None else ", and rows at " + ", ".join(
            f"{celsius:.4g} degC" for celsius in calibration.temperatures.others)
        lines += ["", f"{len(calibration.plan.loads)} points are planned{warm}"]
    return "\n".join([*lines, *(f"note: {note}" for note in calibration.notes), ""])


def calibration_page(calibration: Calibration) -> bytes:
    """Return the calibration as a page with a figure."""
    name, issue = escape(escape_controls(calibration.map.sensor)), calibration.sensors.model.spec.issue
    parts = [
        f"<h1>Calibration of {name}</h1>", soft_paragraph(issue.words),
        f"<p>{escape(calibration.map.form)}</p>",
        html_table(*head_and_rows(calibration.error_rows), calibration.errors_are), *_fit_parts(calibration),
        *_plan_parts(calibration),
        *(f"<p>{escape(note)}</p>" for note in calibration.notes),
    ]
    return html_page(f"Calibration of {escape_controls(calibration.map.sensor)}", parts).encode("utf-8")


def _fit_parts(calibration: Calibration) -> Iterable[str]:
    """Yield the unknowns fitted to the points, and the residuals of each point."""
    if calibration.fit is not None:
        yield "<h2>What the points say of this sensor</h2>"
        yield html_table(MOVED_HEAD, unknown_rows(calibration), MOVED)
    head, rows = point_rows(calibration)
    if rows:
        yield "<h2>Points</h2>"
        yield f"<figure class='paper'>{error_plot(calibration)}<figcaption>{CAPTION}</figcaption></figure>"
        yield html_table(head, rows, "Read: the map less the load. Foretold: the same by a fit without this point.")
    if calibration.drift is not None:
        yield "<h2>Drift with temperature</h2>"
        heading = drift_fit_text(calibration.drift, calibration.map.axes)
        yield html_table(DRIFT_HEAD, drift_rows(calibration.drift), heading)
        yield html_table(*temperature_rows(calibration, calibration.drift))


def _plan_parts(calibration: Calibration) -> Iterable[str]:
    """Yield the HTML table of planned points. Each row has the expected errors after all points up to this row."""
    if calibration.plan is not None:
        axes = calibration.map.axes
        scope = calibration.sensors.range
        loads = np.vstack([scope.normal_load(0.0), calibration.plan.loads])[:, scope.columns] * display_factors(axes)
        rows = []
        for k, (load, errors) in enumerate(zip(loads, calibration.plan.errors * display_factors(axes), strict=True)):
            rows.append([str(k) if k else "tare", *(f"{force:.3g}" for force in load),
                         *(f"{error:.2g}" for error in errors)])
        named = [f"{name} {SHOWN[load_unit(name)][1]}" for name in axes]
        head = ["point", *named, *(f"error of {name}" for name in named)]
        yield "<h2>The points to take</h2>"
        yield html_table(head, rows, PLANNED)


MOVED = f"Moved by: in sigmas of manufacture; more than {UNUSUAL:g} is unusual."

PLANNED = """In the order of what they tell. The errors are those of the first table, once the points so far are
measured."""

CAPTION = "What is left of every point, a colour an axis: filled by the map, hollow as the other points foretell it."

WIDTH, HEIGHT, LEFT, BOTTOM = 640.0, 260.0, 60.0, 34.0
COLOURS = ("#0b5fa5", "#b5541c", "#2c7a3f")


def error_plot(calibration: Calibration) -> str:
    """Draw the errors of each point, in per cent of full scale, over the points' numbers.

    Filled marks are errors of the map, hollow marks are errors of a fit without the point.
    """
    points, fit = calibration.points, calibration.fit
    assert points is not None and points.loads is not None and fit is not None and fit.force_errors is not None
    settled, full = points.without_drift, calibration.map.full_scale
    read = calibration.map(settled.frequency, settled.rest) - points.loads[:, calibration.sensors.range.columns]
    parts = [100.0 * part[~points.at_rest] / full for part in (read, fit.force_errors)]
    most = max(float(np.nanmax(np.abs(part))) for part in parts)
    power = 10.0 ** np.floor(np.log10(most)) if most > 0.0 else 1.0
    most = float(next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= most * (1.0 - 1e-9)))
    sheet = Sheet("What is left of every point", (WIDTH, HEIGHT), unit="", decimals=1)
    middle, half = 0.5 * (HEIGHT + BOTTOM), 0.5 * (HEIGHT - BOTTOM) - 12.0
    for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
        y = middle + share * half
        sheet.line(LEFT, y, WIDTH - 10.0, y, Pen(1.0 if not share else 0.5, "#9aa4ad"))
        sheet.text(LEFT - 6.0, y - 4.0, f"{share * most:+.3g} %" if share else "0", 11.0, "end")
    step = (WIDTH - LEFT - 30.0) / max(len(parts[0]), 1)
    for k in range(len(parts[0])):
        x = LEFT + 15.0 + (k + 0.5) * step
        sheet.text(x, BOTTOM - 16.0, str(k + 1), 11.0, "middle")
        for axis, colour in enumerate(COLOURS[: len(full)]):
            offset = (axis - 0.5 * (len(full) - 1)) * min(12.0, 0.3 * step)
            for part, is_filled in zip(parts, (True, False), strict=True):
                dot = circle(Point(x + offset, middle + half * float(part[k, axis]) / most), 3.5)
                sheet.draw(dot, Pen(1.2, colour), colour if is_filled else None)
    for axis, name in enumerate(calibration.map.axes):
        sheet.text(LEFT + 15.0 + 90.0 * axis, 4.0, name, 11.0, colour=COLOURS[axis])
    return svg(sheet)


LOADING = {
    "held": ("a stiff flat plate of plastic or glass presses on the whole target and on nothing else (of cells, on one",
             "target at a time), guided so that it stays parallel to the board (a linear stage, a press stand), a load",
             "cell behind it; shear is a push on the plate, which is stuck to the target by thin double-sided tape:",
             "laid on, it slips where shear is much. Weights and threads do not keep it level."),
    "free": (
        "a weight falls off a plate that tilts, so it stands on a rod of plastic (polyamide, about 3 mm), whose lower",
        "end is a ball of about 1 mm and touches the target's outermost face. Two holes one above the other in a guide",
        "of plastic, which stands beside the sensor, keep the rod upright and let it slide freely. The weights lie on",
        "a tray on its upper end, as far from the coils as metal has to be. Rod and tray count: weigh them. Turn the",
        "rod a little after each load: what rubs in the guide is not on the target. The rod stands on the middle of",
        "the face; threads for shear are glued there.",
    ),
}
"""Instructions for applying loads, by rotation."""

MOMENTS = ("A moment is a load beside the middle: move the guide until the rod stands at the x and y of the row,",
           "counted from the middle of the outermost face, +x and +y as below. plan.svg has all places on the",
           "target's outline at 1:1. Print it at 100 %, measure its 20 mm, cut the outline out and stick it on.")
"""Instructions for applying moments."""

ASIDE = 0.1e-3
"""Common shift (m) of the places of all loads, for which a plan states the additional errors."""


def place_accuracy_lines(calibration: Calibration, plan: Plan) -> tuple[str, ...]:
    """Describe the required accuracy of the places of loads, and the errors that a common shift causes.

    Empty if the target is kept level.
    """
    if calibration.sensors.is_held:
        return ()
    sigma, axes = usual_value("place"), calibration.sensors.range.axes
    return (
        f"Place: the rod has to stand at its place to {in_mm(sigma)} mm (one sigma; look from two sides under a",
        f"microscope). The expected errors count that. Loads that all stand {in_mm(ASIDE)} mm aside may pass the fit",
        f"without a remark; after all rows they add: {_error_text(ASIDE / sigma * plan.errors_of_offset, axes)}",
        f"({'N, N mm' if calibration.sensors.range.has_moments else 'N'}).",
    )


CARD_SCALE, CARD_EDGE = 5.0, 6.0
"""Scale of the card's picture that names the places, and margin (mm) round both pictures."""


def _place_on_card(middle: Point, centre: Point, scale: float, point: Point) -> Point:
    """Return the place (mm) on the card of a point (m) on the target.

    `middle` (m) is the target's middle, which lies at `centre` (mm) on the card. `scale` is in mm/m.
    """
    return Point(centre.x + scale * (point.x - middle.x), centre.y + scale * (point.y - middle.y))


def plan_card(calibration: Calibration, plan: Plan) -> bytes:
    """Draw the card of load places as an SVG in millimetres.

    One picture is the target's outline with all places at 1:1, to be cut out. A larger picture has the row numbers of
    each place.
    """
    spec, axes = calibration.sensors.model.spec, calibration.sensors.range.axes
    plate = plates_of(spec).targets[0]
    half, middle = [500.0 * side for side in plate.footprint.size], plate.footprint.centre
    rows: dict[tuple[float, float], list[int]] = {}
    for number, load in enumerate(plan.loads, start=1):
        rows.setdefault(load_place(load), []).append(number)
    high, wide = 2.0 * (CARD_SCALE * half[1] + CARD_EDGE), 2.0 * (CARD_SCALE + 1.0) * half[0] + 3.0 * CARD_EDGE
    lines = [f"{calibration.map.sensor}: print at 100 %. This line is 20 mm long.",
             f"{', '.join(axes)}; x and y from the middle of the outermost face, seen on it"]
    size = max(wide, 125.0), high + 16.0
    sheet = Sheet("Places of loads", size, unit="mm", decimals=3)
    at = Point(CARD_EDGE + half[0], size[1] - high / 2), Point(2.0 * (CARD_EDGE + half[0]) + CARD_SCALE * half[0],
                                                              size[1] - high / 2)
    for centre, scale in zip(at, (1.0, CARD_SCALE), strict=True):
        sheet.draw(plate.outline().mapped(partial(_place_on_card, middle, centre, 1e3 * scale)), Pen(0.1))
        for (x, y), numbers in rows.items():
            spot, arm = Point(centre.x + 1e3 * scale * x, centre.y + 1e3 * scale * y), 0.25 * scale
            sheet.line(spot.x - arm, spot.y, spot.x + arm, spot.y, Pen(0.03 * scale))
            sheet.line(spot.x, spot.y - arm, spot.x, spot.y + arm, Pen(0.03 * scale))
            if scale > 1.0:
                sheet.text(spot.x + 0.6, spot.y + 0.6, ", ".join(map(str, numbers)), 1.8)
    end = Point(at[1].x + CARD_SCALE * half[0], at[1].y)
    sheet.text(end.x + 1.0, end.y - 0.8, "+x", 2.5)
    sheet.text(at[1].x, at[1].y + CARD_SCALE * half[1] + 1.5, "+y", 2.5, "middle")
    sheet.line(CARD_EDGE, 12.0, CARD_EDGE + 20.0, 12.0, Pen(0.1))
    for line, word in enumerate(lines):
        sheet.text(CARD_EDGE, 8.0 - 4.0 * line, word, 2.5)
    return svg(sheet).encode("utf-8")


def direction_lines(axes: Sequence[str]) -> tuple[str, ...]:
    """Describe the positive directions of the normal force, and of shear if measured."""
    normal = "Normal forces count towards the board."
    if len(axes) == 1:
        return (normal,)
    return (
        f"{normal} +x runs in the board's plane from the middle of the body to the tail",
        "(to the contacts, if there is none). +y is to its left, seen on the face with the coils: with +x to the",
        "right it points up. A load is the force on the target, not the one that the target holds against it.",
    )


def clamping_lines(coil: CoilSpec, mount: Mount | None) -> tuple[str, ...]:
    """Describe the clamping of the sensor during loading, with the supports and the metal that it has in use."""
    if mount is None:
        return (
            "Hold the sensor as it is used. If nothing holds it yet, stick the board's whole body flat on a stiff",
            "plate that is no metal (10 mm of plastic or glass): metal behind the coils is read.",
        )
    if mount.jaw is not None or mount.kind == "grasper-pad":
        return (
            "Hold the sensor by its jaw, glued in as in use: clamp the jaw's metal behind the tail's fixing in a vice,",
            "its face level. Open the other jaw: the map is of open jaws. After the last row, bring the other jaw as",
            "near as in use, without touching: the force that is then read is an error in use. The data sheet predicts",
            "it (other jaw's metal). If the same thing is grasped each time, fix a plate of the jaw's metal over the",
            "target, as far away as in use, so that it moves with the loads: the tare and all rows then have it.",
        )
    what = {"bench-plate": "Screw the mount down by all its holes,",
            "fingertip": "Slip the cap on its finger, tighten both screws, and clamp the finger,"}
    return (
        f"{what.get(mount.kind, 'Fasten your mount as in use,')} so that nothing gives way but the pad. Metal near the",
        "coils stays where it is in use. No other metal, load cell and stage included, comes nearer to them than",
        f"{in_mm(metal_free_distance(coil), 1)} mm. Lead the tail away without a pull.",
        *(() if mount.metal_behind is None else (
            f"The {mount.metal_behind.material.name} behind the board has to be there: "
            f"{show(mount.metal_behind.distance, 'm')} away, and the glue.",)),
    )


def plan_csv(calibration: Calibration) -> bytes:
    """Return the loads as the CSV for `sitscad calibrate`; its first line states the target's rotation.

    If the plan has further temperatures, the column ``temperature_degC`` has the planned temperature of each row.
    """
    sensors = calibration.sensors
    scale = display_factors(sensors.range.axes)
    loads, celsius = calibration.planned_rows
    rows = [[f"{force:.4g}" for force in scale * load[sensors.range.columns]] for load in loads]
    if celsius is not None:
        rows = [[*row, f"{each:.4g}"] for row, each in zip(rows, celsius, strict=True)]
    coils = calibration.table_coils
    texts = [",".join([*row, *[""] * len(coils)]) for row in rows]
    return ("\n".join([*table_head(sensors, coils, celsius is not None), *texts]) + "\n").encode("ascii")


READ_BY_FIRMWARE = (
    "   `sitscad read SOURCE --design SPEC --log FOLDER` writes the readings of a board that runs firmware/ to",
    "   FOLDER/readings.csv. Frequencies may be filled in, too: in Hz, in columns C1_Hz, C2_Hz, ... in place of",
    "   counts.",
)
"""Lines of the plan for a converter whose driver is in the package."""


def plan_instructions(calibration: Calibration, plan: Plan) -> bytes:
    """Return the plan's instructions, and the expected errors after each point."""
    scope, readings, spec = calibration.sensors.range, int(usual_value("readings")), calibration.sensors.model.spec
    has_moments = scope.has_moments
    rotation, conversion = calibration.sensors.rotation, calibration.sensors.conversion
    device, issue = spec.readout.device, spec.issue
    counts_note = f": {device.part}_COUNTS of results, firmware/{device.name}_config.h" if conversion.is_partial else ""
    (other,) = (name for name in ROTATIONS if name != rotation)
    of, units = "" if calibration.cell is None else f" --cell {calibration.cell}", "N, N mm" if has_moments else "N"
    lines = [
        f"Calibration of the sensor {calibration.map.sensor}", *([f"{issue.title}."] if issue.rows else []), "",
        "SPEC in the commands is the sensor's YAML file. A package has it in its folder spec/.", "",
        "1. Let board and converter run for ten minutes, and load the sensor fully and unload it five to ten times:",
        "   raw readings drift after start, and silicones soften on the first pulls.",
        "2. Fill in plan.csv: for every row put the load on, wait ten seconds, write down the mean of",
        f"   {readings} readings (counts{counts_note}) of every coil. The target is {ROTATIONS[rotation]}:",
        *(f"   {line}" for line in (*LOADING[rotation], *(MOMENTS if scope.has_moments else ()))),
        *(f"   {line}" for line in place_accuracy_lines(calibration, plan)),
        *(f"   {line}" for line in (*direction_lines(scope.axes),
                                    *clamping_lines(spec.coil, spec.mount))),
        *(READ_BY_FIRMWARE if device.has_driver else ("   Frequencies may be filled in, too: in Hz, in columns C1_Hz, "
                                                      "C2_Hz, ... in place of counts.",)),
        *([] if scope.has_moments else [
            "   The first line of plan.csv, `# rotation:`, says whether the target is held level or free to tilt:",
            "   `sitscad calibrate` fits the map for that, and warns if the readings look like the other."]),
        "3. Rows of zeros are tares, without load: the first, one in the middle, one at the end, and more between as",
        "   often as you like. Every row goes with the tare before it, so drift is taken out; three or more show",
        "   the noise of the readings.",
        *temperature_lines(calibration),
        f"{4 if calibration.temperatures is None else 5}. `sitscad calibrate SPEC plan.csv{of}` fits the sensor, and "
        "writes calibration.h and calibration.json. The",
        f"   map is that of a target which is {ROTATIONS[rotation]} in use, too" + (
            "." if scope.has_moments else f"; for one that is {ROTATIONS[other]}"),
        *([] if scope.has_moments else [f"   `sitscad calibrate SPEC --rotation {other}{of}` makes the plan."]), "",
        "The loads are in the order of their benefit: you may leave out the last ones, and add others. The expected",
        "error is one sigma of the force from unit to unit, over all loads, after the rows so far are measured. It",
        "holds for pads about as stiff as drawn; a much softer pad has a larger error, which its own calibration",
        "states. Noise, hysteresis, creep and temperature add to it.", "", 
        f"{'row':>3}  {'load':<48}  {f'expected error ({units})':<30}",
        f"{'':>3}  {'not even the tare':<48}  {_error_text(plan.errors_without_tare, scope.axes):<30}".rstrip(),
        f"{'':>3}  {'the tare alone, not calibrated':<48}  {_error_text(plan.errors[0], scope.axes):<30}".rstrip(),
    ]
    for number, (load, error) in enumerate(zip(plan.loads, plan.errors[1:], strict=True), start=1):
        load_text = load_instruction(load, scope.axes, rotation)
        lines.append(f"{number:>3}  {load_text:<48}  {_error_text(error, scope.axes):<30}".rstrip())
    weighed = [] if calibration.sensors.is_held else ["Weights by g = 9.80665 m/s^2."]
    lines += ["", *weighed, *(f"Note: {note}." for note in calibration.notes), ""]
    return "\n".join(lines).encode("ascii", "replace")


def temperature_lines(calibration: Calibration) -> tuple[str, ...]:
    """Describe the rows at further temperatures, the wait before them, and the drift that they leave.

    Empty if the plan has no further temperatures.
    """
    planned, axes = calibration.temperatures, calibration.sensors.range.axes
    if planned is None:
        return ()
    others = " and ".join(f"{celsius:.4g} degC" for celsius in planned.others)
    thermometer = (f"a thermometer beside the sensor shows, and the counts of the reference coil {planned.reference}."
                   if planned.reference else "the firmware reads.")
    by_design, measured = (_error_text(left, axes) for left in planned.left)
    return (
        f"4. The rows at {planned.base:.4g} degC come first. Then bring the whole sensor with its holder to {others},",
        f"   and wait until temperature and coils have stood still for {planned.soak:.0f} s: the pad lags behind.",
        "   Take the other rows there, with the same weights. Write the temperature of each row into the column",
        f"   temperature_degC in place of the planned one, as {thermometer}",
        f"   Reason: {planned.reason}.",
        f"   Drift at full load (N): {by_design} with coefficients of the design;",
        f"   {measured} with measured ones.",
    )


def _error_text(errors: Array, axes: Sequence[str]) -> str:
    return ", ".join(f"{name} {error:.2g}" for name, error in zip(axes, display_factors(axes) * errors, strict=True))
