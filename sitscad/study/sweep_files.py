"""A sweep as text, CSV, JSON, arrays and a picture."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from sitscad.arrays import Array, Flags
from sitscad.checks import all_rules
from sitscad.report.findings import to_json
from sitscad.study.evaluation import FAILS
from sitscad.study.measures import MEASURES
from sitscad.study.sweeping import SweepTable
from sitscad.units import cell, show
from sitscad.version import __version__


def shown(name: str, value: float, digits: int = 4) -> str:
    """A figure of a measure for people; a dash where there is none."""
    unit = MEASURES[name].unit
    if not math.isfinite(value):
        return "-"
    return f"{1e6 * value:.{digits}g} mm2" if unit == "m2" else show(value, unit, digits)


def sweep_text(table: SweepTable) -> str:
    """One line a design: keys, figures, verdict and rules."""
    head = [*table.keys, *table.values, "verdict", "refused by"]
    rows = [
        [*(str(values[k]) for values in table.keys.values()),
         *(shown(name, float(values[k])) for name, values in table.values.items()),
         table.verdict[k], ", ".join(table.refused_by[k])]
        for k in range(len(table))
    ]
    return aligned([head, *rows])


def aligned(rows: Sequence[Sequence[str]]) -> str:
    """Rows with their cells under each other."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ("  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows)
    return "\n".join(lines) + "\n"


def sweep_csv(table: SweepTable) -> str:
    """One row a design, columns named by key and measure; what a design has not is empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    named = [title for name in table.values for title in (name, f"{name}.error")]
    writer.writerow([*table.keys, *named, "verdict", "refused_by", "warned_by"])
    for k in range(len(table)):
        keys = [values[k] for values in table.keys.values()]
        pairs = [cell(float(of[name][k])) for name in table.values for of in (table.values, table.errors)]
        rules = " ".join(table.refused_by[k]), " ".join(table.warned_by[k])
        writer.writerow([*keys, *pairs, table.verdict[k], *rules])
    return text.getvalue()


def sweep_json(table: SweepTable) -> str:
    """The table by columns, with units."""
    columns = {
        name: {"unit": MEASURES[name].unit, "value": values.tolist(), "error": table.errors[name].tolist()}
        for name, values in table.values.items()
    }
    return to_json({
        "sitscad": __version__, "spec": table.spec, "level": table.level, "shape": list(table.shape),
        "keys": {key: list(values) for key, values in table.keys.items()}, "measures": columns,
        "verdict": list(table.verdict), "refused_by": list(map(list, table.refused_by)),
        "warned_by": list(map(list, table.warned_by)),
    })


def sweep_npz(table: SweepTable) -> bytes:
    """Arrays under the names of keys and measures, ``NAME.error`` beside each; the same bytes every time."""
    arrays: dict[str, Any] = {key: np.array(values) for key, values in table.keys.items()}
    for name, values in table.values.items():
        arrays |= {name: values, f"{name}.error": table.errors[name]}
    arrays["verdict"] = np.array(table.verdict)
    arrays["refused_by"] = np.array([" ".join(rules) for rules in table.refused_by])
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


PANEL = (140.0, 80.0)
"""One picture on a sheet (mm)."""


def sweep_svg(table: SweepTable) -> str:
    """Of one key a curve a measure, with its band of error; of two a field a measure, in whose cells nothing is
    interpolated, with the edges of what each rule refuses. Raises ValueError for more keys.
    """
    from sitscad.drawing.sheet import Sheet, plot
    from sitscad.drawing.svg import svg

    if len(table.keys) > 2:
        raise ValueError(f"a picture has one key or two, not {len(table.keys)}; .csv takes any number")
    names = [name for name, values in table.values.items() if np.isfinite(values).any()]
    if not names:
        raise ValueError("no design of this sweep has a figure that could be drawn")
    width, height = PANEL
    sheet = Sheet(f"Sweep of {', '.join(table.keys)}", (width, height * len(names)))
    for k, name in enumerate(names):
        draw = _curve(table, name) if len(table.keys) == 1 else _field(table, name)
        plot(sheet, (4.0, height * (len(names) - 1 - k) + 2.0, width - 8.0, height - 4.0), draw)
    return svg(sheet)


def scale_of(name: str, values: Array) -> tuple[float, str]:
    """The factor and the unit in which a measure is drawn."""
    finite = np.abs(values[np.isfinite(values)])
    most = float(finite.max()) if finite.size else 0.0
    unit = shown(name, most).partition(" ")[2] if most else MEASURES[name].unit
    number = float(shown(name, most).partition(" ")[0]) if most else 1.0
    return (10.0 ** round(math.log10(number / most)) if most else 1.0), unit


def _axis(values: Sequence[Any]) -> tuple[Array, list[str] | None]:
    """Where values stand on an axis, and their names where they are no numbers of one unit."""
    found = [re.fullmatch(r"\s*([-+.\deE]+)\s*([^\d]*)", str(value)) for value in values]
    units = {match[2] for match in found if match is not None}
    if all(found) and len(units) == 1:
        numbers = np.array([float(match[1]) for match in found if match is not None])
        if len(set(numbers.tolist())) == len(numbers):
            return numbers, None
    return np.arange(len(values), dtype=float), [str(value) for value in values]


def _titled(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit else name


def _label(key: str, values: Sequence[Any]) -> str:
    unit = re.fullmatch(r"\s*[-+.\deE]+\s*([^\d]+)", str(values[0]))
    return f"{key} ({unit[1].strip()})" if unit else key


def _curve(table: SweepTable, name: str) -> Callable[[Any], None]:
    (key, written), = table.keys.items()

    def draw(figure: Any) -> None:
        axes, (at, names) = figure.subplots(), _axis(written)
        factor, unit = scale_of(name, table.values[name])
        values, errors = factor * table.values[name], factor * table.errors[name]
        failed = np.array([verdict == FAILS for verdict in table.verdict])
        (line,) = axes.plot(at, values, marker="o", markersize=2.5, linestyle="-" if names is None else "")
        axes.fill_between(at, values - errors, values + errors, alpha=0.18, color=line.get_color(), linewidth=0.0,
                          label="what it may be off by")
        if failed.any():
            axes.plot(at[failed], values[failed], marker="x", markersize=6.0, linestyle="", color="#a02020",
                      label="refused by a rule")
        axes.set(xlabel=_label(key, written), ylabel=_titled(name, unit))
        if names is not None:
            axes.set_xticks(at, names)
        axes.legend()

    return draw


def _field(table: SweepTable, name: str) -> Callable[[Any], None]:
    (first, firsts), (second, seconds) = table.keys.items()
    rows, columns = table.shape
    down, across = firsts[::columns], seconds[:columns]

    def draw(figure: Any) -> None:
        axes, (x, x_names), (y, y_names) = figure.subplots(), _axis(across), _axis(down)
        factor, unit = scale_of(name, table.values[name])
        values = factor * table.values[name].reshape(rows, columns)
        xs, ys = _borders(x), _borders(y)
        mesh = axes.pcolormesh(xs, ys, np.ma.masked_invalid(values), cmap="viridis", linewidth=0.0)
        figure.colorbar(mesh, ax=axes, label=_titled(name, unit))
        rules, titles = sorted({rule for refused in table.refused_by for rule in refused}), rule_titles()
        for k, rule in enumerate(rules):
            refused = np.array([rule in each for each in table.refused_by]).reshape(rows, columns)
            _edge(axes, refused, xs, ys, titles.get(rule, rule), EDGES[k % len(EDGES)])
        axes.set(xlabel=_label(second, across), ylabel=_label(first, down))
        for names, ticks, at in ((x_names, axes.set_xticks, x), (y_names, axes.set_yticks, y)):
            if names is not None:
                ticks(at, names)
        if rules:
            figure.legend(loc="outside upper left", title="refused within", ncols=3, facecolor="#c8cdd2", frameon=True)

    return draw


def rule_titles() -> dict[str, str]:
    """Every rule with its name, by its identifier."""
    return {rule.id: f"{rule.id} {rule.name}" for rule in all_rules()}


EDGES = ("#d02020", "#ffffff", "#ff9a1f", "#111111", "#e05ab0", "#8ae0ff")
"""Colours of rules' edges on a field."""


def _borders(middles: Array) -> Array:
    """Where cells about values begin and end."""
    if len(middles) == 1:
        return np.array([middles[0] - 0.5, middles[0] + 0.5])
    between = (middles[1:] + middles[:-1]) / 2.0
    return np.concatenate([[2.0 * middles[0] - between[0]], between, [2.0 * middles[-1] - between[-1]]])


def _edge(axes: Any, refused: Flags, xs: Array, ys: Array, rule: str, colour: str) -> None:
    """The border of the cells that a rule refuses, along the cells; nothing is said of what lies between designs."""
    inside = np.pad(refused, 1)
    lines: list[tuple[list[float], list[float]]] = []
    for i, k in zip(*np.nonzero(inside[1:, 1:-1] != inside[:-1, 1:-1]), strict=True):
        lines.append(([xs[k], xs[k + 1]], [ys[i], ys[i]]))
    for i, k in zip(*np.nonzero(inside[1:-1, 1:] != inside[1:-1, :-1]), strict=True):
        lines.append(([xs[k], xs[k]], [ys[i], ys[i + 1]]))
    for n, (along, up) in enumerate(lines):
        axes.plot(along, up, color=colour, linewidth=1.6, label=rule if n == 0 else "_nolegend_")


def _bytes(write: Callable[[SweepTable], str]) -> Callable[[SweepTable], bytes]:
    return lambda table: write(table).encode("utf-8")


SWEEP_FORMATS: Mapping[str, Callable[[SweepTable], str]] = {"text": sweep_text, "csv": sweep_csv, "json": sweep_json}
"""How `sweep` prints."""

SWEEP_FILES: Mapping[str, Callable[[SweepTable], bytes]] = {
    ".csv": _bytes(sweep_csv), ".json": _bytes(sweep_json), ".npz": sweep_npz, ".svg": _bytes(sweep_svg),
}
"""What `sweep -o` writes, by ending."""
