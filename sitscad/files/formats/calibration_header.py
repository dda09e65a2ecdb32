"""Calibration maps from readings to forces as C99 headers, one for all cells, and a program that uses a map.

The C code needs no heap and no library function except logf. It gives equal results on every machine.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sitscad.basics.version import __version__
from sitscad.calibration.inverse_map import BEYOND, LEAST, InverseMap
from sitscad.estimates.performance_values import AXES, MOMENTS, load_unit
from sitscad.files.writer import comment_text
from sitscad.kernels.converters.conversion import Conversion

WIDTH = 116  # Columns of a line at most


def header(inverse: InverseMap, conversion: Conversion, remarks: Sequence[str] = (), cell: int | None = None) -> bytes:
    """Return the C header of a calibration map.

    Parameters
    ----------
    inverse
        The map.
    conversion
        Settings of the converter: format and range of its counts.
    remarks
        Lines for the comment at the head of the file.
    cell
        Number of a cell. If given, every name begins with ``sitscad_cellN_``, so that a program can include the
        headers of all cells.
    """
    counts = ", ".join(f"{int(count)}u" for count in inverse.rest)
    lines = [
        *_opening(inverse),
        *_tables(inverse),
        *_ends(inverse, conversion),
        "", "/* The tare to be expected; a tare far from it is another sensor, or a fault. */",
        f"static const struct sitscad_tare sitscad_usual_tare = {{{{{counts}}}}};",
        "",
        *_changes(inverse, conversion),
        *SUMMED,
        "",
        "#endif",
        "",
    ]
    text = "\n".join([*_comment(inverse, conversion, remarks), of_cell("\n".join(lines), cell)])
    return text.encode("ascii", "replace")


def program(cell: int | None = None) -> bytes:
    """Return the C source of a program that converts counts to newtons with a map's header.

    With `cell`, it uses the names in the header of this cell.
    """
    return of_cell(PROGRAM, cell).encode("ascii")


def of_cell(text: str, cell: int | None) -> str:
    """Return C code with ``sitscad_`` changed to ``sitscad_cellN_``, N being the cell's number, also in capitals.

    Unchanged if `cell` is None.
    """
    if cell is None:
        return text
    return text.replace("sitscad_", f"sitscad_cell{cell}_").replace("SITSCAD_", f"SITSCAD_CELL{cell}_")


def _comment(inverse: InverseMap, conversion: Conversion, remarks: Sequence[str]) -> list[str]:
    """Return the comment at the head of the file: sensor, standard deviations, inputs and outputs."""
    shown = ", ".join(f"{name} {error:.3g} {load_unit(name)} of {full:.3g}"
                      for name, error, full in zip(inverse.axes, inverse.error, inverse.full_scale, strict=True))
    device, coils = conversion.device, ", ".join(map(comment_text, inverse.coils))
    if conversion.is_partial:
        counts = [f"of the coils {coils}, in this order, as {device.part}_COUNTS of {device.name}_config.h",
                  f"   makes them of results: {conversion.count_bits} bits, of which a result shows some."]
    else:
        counts = [f"{device.bits}-bit results of the coils {coils}, in this order."]
    axes = ", ".join(map(comment_text, inverse.axes))
    revision = f", revision {comment_text(inverse.revision)}" if inverse.revision else ""
    return [
        "/*",
        f" * Forces of the sensor {comment_text(inverse.sensor)}{revision}, from the counts of its converter.",
        f" * Made by sitscad {__version__}.",
        f" * One sigma of the force: {shown} (full scale).",
        *(f" * {comment_text(line)}" for line in remarks),
        " *",
        f" * counts: {counts[0]}",
        *(f" * {line}" for line in counts[1:]),
        f" * forces: {axes}, in newtons; normal is positive towards the board.",
        *([" * moments in newton metres, on the middle of the outermost face of a target that is free to tilt."]
          if set(inverse.axes) & set(MOMENTS) else []),
        " * tare: counts without load, the mean of some readings. Take it again when the temperature has changed.",
        " *",
        " * C99; no heap, no state; of the library logf alone.",
        " */",
    ]


def _units(inverse: InverseMap) -> str:
    return ", ".join(dict.fromkeys(load_unit(name) for name in inverse.axes))


def _opening(inverse: InverseMap) -> list[str]:
    """Return the include guard, the sizes, and the names of axes and results."""
    return [
        "#ifndef SITSCAD_CALIBRATION_H",
        "#define SITSCAD_CALIBRATION_H",
        "",
        "#include <math.h>",
        "#include <stdint.h>",
        "",
        f"#define SITSCAD_COILS {len(inverse.coils)}",
        f"#define SITSCAD_AXES {len(inverse.axes)}",
        *(f"#define SITSCAD_{name.upper()} {k}" for k, name in enumerate(inverse.axes)),
        f"#define SITSCAD_TERMS {len(inverse.powers)}",
        f"#define SITSCAD_POWERS {1 + int(inverse.powers.max())}",
        "",
        "#define SITSCAD_OK 0",
        "#define SITSCAD_NO_READING 1 /* a coil or its tare reads nothing, or over its range: forces are 0 */",
        "#define SITSCAD_BEYOND 2     /* outside what the map was made for: forces are those at its end */",
        "",
        "/* Counts without load. */",
        "struct sitscad_tare {",
        "    uint32_t counts[SITSCAD_COILS];",
        "};",
        "",
    ]


def _tables(inverse: InverseMap) -> list[str]:
    """Return the map's numbers as constant arrays of C."""
    return [
        "/* What every coil's relative change is multiplied with. */",
        *array_of("float", "sitscad_gain", "[SITSCAD_COILS]", float_texts(inverse.gain)),
        "/* How the coils are mixed. */",
        *_matrix("float", "sitscad_mix", "[SITSCAD_AXES][SITSCAD_COILS]", [float_texts(row) for row in inverse.mix]),
        "", f"/* Where the map was made, with a margin; full scales ({_units(inverse)}). */",
        *array_of("float", "sitscad_low", "[SITSCAD_AXES]", float_texts(inverse.low - BEYOND)),
        *array_of("float", "sitscad_high", "[SITSCAD_AXES]", float_texts(inverse.high + BEYOND)),
        *array_of("float", "sitscad_full_scale", "[SITSCAD_AXES]", float_texts(inverse.full_scale)),
        "", "/* Powers of every term, and its coefficient for every axis. */",
        *_matrix("uint8_t", "sitscad_powers", "[SITSCAD_TERMS][SITSCAD_AXES]",
                 [map(str, row) for row in inverse.powers]),
        *_matrix("float", "sitscad_coefficients", "[SITSCAD_AXES][SITSCAD_TERMS]",
                 [float_texts(row) for row in inverse.coefficients]),
    ]


def _ends(inverse: InverseMap, conversion: Conversion) -> list[str]:
    """Return C arrays with the counts of each coil's smallest and largest possible result. Both mean: no reading.

    Empty if results show whole conversions, because the limits are then equal for all coils.
    """
    if not conversion.is_partial:
        return []
    least, most = zip(*(conversion.ends(coil) for coil in range(len(inverse.coils))), strict=True)
    return [
        "", "/* Counts of the smallest and the largest result: both say that a coil gives none. */",
        *array_of("uint32_t", "sitscad_least", "[SITSCAD_COILS]", (f"{count}u" for count in least)),
        *array_of("uint32_t", "sitscad_most", "[SITSCAD_COILS]", (f"{count}u" for count in most)),
    ]


def _changes(inverse: InverseMap, conversion: Conversion) -> list[str]:
    """Return the beginning of the C function: the signal of every coil from its counts and the tare's counts."""
    most = f"0x{conversion.ends(0)[1]:08X}u"
    beyond = f"now == 0u || now >= {most} || rest == 0u || rest >= {most}"
    if conversion.is_partial:
        ends = (f"{name} <= sitscad_least[coil] || {name} >= sitscad_most[coil]" for name in ("now", "rest"))
        beyond = " || ".join(ends)
    return [
        f"/* Forces ({_units(inverse)}) at counts after a tare; SITSCAD_OK, or what is wrong. */",
        "static inline int sitscad_forces(const uint32_t counts[SITSCAD_COILS], const struct sitscad_tare *tare,",
        "                                 float forces[SITSCAD_AXES])",
        "{",
        "    float seen[SITSCAD_COILS], power[SITSCAD_AXES][SITSCAD_POWERS];",
        "    int result = SITSCAD_OK;",
        "",
        "    for (int axis = 0; axis < SITSCAD_AXES; ++axis)",
        "        forces[axis] = 0.0f;",
        "    for (int coil = 0; coil < SITSCAD_COILS; ++coil) {",
        "        const uint32_t now = counts[coil], rest = tare->counts[coil];",
        f"        if ({beyond})",
        "            return SITSCAD_NO_READING;",
        "        /* the difference of whole numbers is exact: no digits are lost */",
        "        const float share = (float)((int32_t)rest - (int32_t)now) / (float)now;",
        "        const float change = share * (2.0f + share); /* L over that at rest, less 1 */",
        "        const float left = 1.0f - sitscad_gain[coil] * change;",
        f"        seen[coil] = logf(left > {LEAST:.0e}f ? left : {LEAST:.0e}f);",
        "    }",
    ]


SUMMED = (
    "    for (int axis = 0; axis < SITSCAD_AXES; ++axis) {",
    "        float mixed = 0.0f;",
    "        for (int coil = 0; coil < SITSCAD_COILS; ++coil)",
    "            mixed += sitscad_mix[axis][coil] * seen[coil];",
    "        /* beyond its ends the map would run away: it is read at the end */",
    "        if (!(mixed >= sitscad_low[axis])) {",
    "            mixed = sitscad_low[axis];",
    "            result = SITSCAD_BEYOND;",
    "        } else if (mixed > sitscad_high[axis]) {",
    "            mixed = sitscad_high[axis];",
    "            result = SITSCAD_BEYOND;",
    "        }",
    "        power[axis][0] = 1.0f;",
    "        for (int k = 1; k < SITSCAD_POWERS; ++k)",
    "            power[axis][k] = power[axis][k - 1] * mixed;",
    "    }",
    "    for (int k = 0; k < SITSCAD_TERMS; ++k) {",
    "        float term = 1.0f;",
    "        for (int axis = 0; axis < SITSCAD_AXES; ++axis)",
    "            term *= power[axis][sitscad_powers[k][axis]];",
    "        for (int axis = 0; axis < SITSCAD_AXES; ++axis)",
    "            forces[axis] += sitscad_coefficients[axis][k] * term;",
    "    }",
    "    for (int axis = 0; axis < SITSCAD_AXES; ++axis)",
    "        forces[axis] *= sitscad_full_scale[axis];",
    "    return result;",
    "}",
)
"""C code that mixes the coils, clips the axes to the map's range, sums the terms and ends the function."""


def float_texts(values: Iterable[float]) -> list[str]:
    """Return numbers as float constants of C with nine digits, which identify every float."""
    return [f"{float(value) + 0.0:.8e}f" for value in values]


def array_of(kind: str, name: str, size: str, values: Iterable[str]) -> list[str]:
    """Return the lines of a constant array of C."""
    return [f"static const {kind} {name}{size} = {{", *_wrapped(values, "    "), "};"]


def _matrix(kind: str, name: str, size: str, rows: Iterable[Iterable[str]]) -> list[str]:
    lines = [f"static const {kind} {name}{size} = {{"]
    for row in rows:
        wrapped = _wrapped(row, "     ")
        wrapped[0] = "    {" + wrapped[0].lstrip()
        lines += [*wrapped[:-1], wrapped[-1].rstrip(",") + "},"]
    return [*lines, "};"]


def _wrapped(values: Iterable[str], indent: str) -> list[str]:
    """Return values with commas, in indented lines of at most WIDTH characters."""
    lines, line = [], indent
    for value in values:
        if len(line) + len(value) + 2 > WIDTH and line.strip():
            lines.append(line.rstrip())
            line = indent
        line += f"{value}, "
    return [*lines, line.rstrip()]


PROGRAM = r"""/*
 * Reads counts of all coils, a line a reading, the tare first; prints the forces in newtons, a line a reading.
 *
 *     cc -std=c99 -O2 -o forces example.c -lm && ./forces < counts.txt
 *
 * Ends with 1 where a line cannot be read, with 2 where a coil gave no reading or its counts are beyond the map.
 */
#include <stdio.h>

#include "calibration.h"

static int line_of(uint32_t counts[SITSCAD_COILS])
{
    for (int coil = 0; coil < SITSCAD_COILS; ++coil) {
        unsigned long count;
        const int got = scanf("%lu", &count);
        if (got != 1)
            return got == EOF && coil == 0 ? EOF : 0;
        counts[coil] = (uint32_t)count;
    }
    return 1;
}

int main(void)
{
    struct sitscad_tare tare;
    uint32_t counts[SITSCAD_COILS];
    float forces[SITSCAD_AXES];
    int worst = 0, got;

    if (line_of(tare.counts) != 1)
        return 1;
    while ((got = line_of(counts)) == 1) {
        if (sitscad_forces((const uint32_t *)counts, &tare, forces) != SITSCAD_OK)
            worst = 2;
        for (int axis = 0; axis < SITSCAD_AXES; ++axis)
            printf(axis ? " %.6g" : "%.6g", (double)forces[axis]);
        printf("\n");
    }
    return got == EOF ? worst : 1;
}
"""
"""C99 source of the program."""


def cells_header(cells: int, is_compensated: bool) -> str:
    """Return ``cells.h``, which includes the maps of all cells under the names from ``calibration_header``.

    If `is_compensated`, it also includes ``temperature.h`` of each cell, with the drift by temperature.
    """
    numbers = range(1, cells + 1)
    lines = [
        "/*",
        " * The maps of all cells. cell-N/calibration.h of this one sensor beside this file goes before the package's,",
        " * which is that of a drawing.",
        " */",
        "#ifndef CELLS_H",
        "#define CELLS_H",
        "",
    ]
    names = ("calibration.h", "temperature.h") if is_compensated else ("calibration.h",)
    for path in (f"cell-{k}/{name}" for k in numbers for name in names):
        lines += [
            "#if !defined(__has_include)", f'#include "{path}"',
            f'#elif __has_include("{path}")', f'#include "{path}"',
            f'#elif __has_include("../calibration/{path}")', f'#include "../calibration/{path}"',
            "#endif",
        ]
    lines += [
        "#ifdef SITSCAD_COILS",
        '#error "a calibration.h of these was made without the number of its cell (--cell)"',
        "#endif",
        "", "#if " + " \\\n    || ".join(f"defined(SITSCAD_CELL{k}_AXES)" for k in numbers),
    ]
    for k in numbers:
        lines += [f"#ifndef SITSCAD_CELL{k}_AXES",
                  f'#error "cell-{k}/calibration.h is absent, or that of another cell"',
                  f"#elif SITSCAD_CELL{k}_COILS != SENSOR_CELL_COILS",
                  f'#error "cell-{k}/calibration.h is another sensor\'s: its number of coils is not SENSOR_CELL_COILS"',
                  "#endif"]
    lines += ["", "/* Axes of every cell. */", "#define SITSCAD_AXES SITSCAD_CELL1_AXES", "#define SITSCAD_OK 0"]
    for axis in map(str.upper, AXES):
        lines += [f"#ifdef SITSCAD_CELL1_{axis}", f"#define SITSCAD_{axis} SITSCAD_CELL1_{axis}", "#endif"]
        for k in numbers[1:]:
            lines += [f"#if defined(SITSCAD_CELL{k}_{axis}) != defined(SITSCAD_CELL1_{axis})",
                      f'#error "cell-{k}/calibration.h has other axes than that of cell 1"', "#endif"]
    if is_compensated:
        lines += [
            "#ifdef SITSCAD_CELL1_NO_TEMPERATURE",
            "#define SITSCAD_NO_TEMPERATURE SITSCAD_CELL1_NO_TEMPERATURE", "#endif",
            "#ifdef SITSCAD_CELL1_COLDEST", "#define SITSCAD_COLDEST SITSCAD_CELL1_COLDEST",
            "#define SITSCAD_HOTTEST SITSCAD_CELL1_HOTTEST", "#endif",
            "#ifdef SITSCAD_CELL1_BY_REFERENCE", "#define SITSCAD_BY_REFERENCE",
            "#define sitscad_warming sitscad_cell1_warming", "#endif"]
    return "\n".join([*lines, *_cell_map(numbers), "#endif", "", "#endif", ""])


def _cell_map(numbers: Iterable[int]) -> list[str]:
    """Return the C function that computes the forces of a cell with its map."""
    lines = [
        "",
        "/*",
        " * Forces by the map of a cell (from 0) at counts of its coils after their tare; 0, or what is wrong.",
        " * `kelvin` is the temperature change since the tare.",
        " */",
        "static inline int sensor_cell_map(int cell, const uint32_t *counts, const uint32_t *rest, float kelvin,",
        "                                  float *newtons)",
        "{",
        "    (void)kelvin;",
        "    switch (cell) {",
    ]
    for k in numbers:
        lines += [
            f"    case {k - 1}: {{",
            f"        struct sitscad_cell{k}_tare tare;",
            "        for (int coil = 0; coil < SENSOR_CELL_COILS; ++coil)",
            "            tare.counts[coil] = rest[coil];",
            f"#ifdef SITSCAD_CELL{k}_NO_TEMPERATURE",
            f"        return sitscad_cell{k}_compensated(counts, &tare, kelvin, newtons);",
            "#else",
            f"        return sitscad_cell{k}_forces(counts, &tare, newtons);",
            "#endif",
            "    }",
        ]
    return [*lines, "    default:", "        return 1;", "    }", "}"]
