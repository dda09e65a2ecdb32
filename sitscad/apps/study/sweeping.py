"""Sweeps: evaluation of all combinations of several ranges of values, as a table of arrays.

The table can be written as text, CSV, JSON, arrays or a picture. The module also lists the measures.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from sitscad.apps.study.evaluating import NO_SCREEN, Executor, Workers, evaluate_design, screen_designs
from sitscad.apps.study.evaluation import FAILS, FULL, SCREEN, Evaluation
from sitscad.apps.study.measures import MEASURES, checked_measure_names
from sitscad.apps.study.space import Base, Changes, RangeError, require_key, values_by_count
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record, replace
from sitscad.basics.units import aligned_lines, csv_text, number_cell, quantity
from sitscad.basics.version import __version__
from sitscad.checks.findings import to_json
from sitscad.checks.judging import all_rules
from sitscad.files.drawing.sheet import Sheet, draw_figure
from sitscad.files.drawing.svg import svg
from sitscad.spec.load import plain_data, written_value
from sitscad.spec.reading import SpecError, finding_from_text
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import SpecSource, TextError, plain_value

Progress = Callable[[int, int], None]

MOST_DESIGNS = 1_000_000
"""Largest number of designs in a sweep."""


@record(eq=False)
class SweepTable:
    """A table of evaluations with one row per design. The last key changes fastest.

    ``keys`` are the values of each varied key as given. ``values`` and ``errors`` are arrays by measure: values and
    error bounds in the measure's unit, NaN if missing. ``verdict``, ``refused_by`` and ``warned_by`` are the results of
    the rules.
    """

    spec: str
    level: str
    keys: Mapping[str, tuple[Any, ...]]
    values: Mapping[str, Array]
    errors: Mapping[str, Array]
    verdict: tuple[str, ...]
    refused_by: tuple[tuple[str, ...], ...]
    warned_by: tuple[tuple[str, ...], ...]
    shape: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.verdict)

    def __repr__(self) -> str:
        """Return a line with the numbers of designs, keys and measures."""
        return f"<SweepTable of {len(self)} designs: {', '.join(self.keys)}; {', '.join(list(self.values)[:4])}>"


@checked_arguments
def measure(spec: SensorSpec, measures: Sequence[str] | None = None, *, level: str = SCREEN) -> Evaluation:
    """Return measures of one design, each with its error bound, and the verdict of the rules.

    Parameters
    ----------
    spec
        The design.
    measures
        Names of measures (``sitscad measures`` lists them). If None, all measures of the level except ranges, sigmas
        and the yield.
    level
        ``"screen"`` is quick, ``"full"`` computes everything that `check` computes.

    Returns
    -------
    Evaluation
        ``values`` by measure, each a pair of value and error bound in SI units; ``verdict``, ``refused`` and
        ``warned``.

    Raises
    ------
    ValueError
        If there is no such level or measure.

    Examples
    --------
    >>> import sitscad
    >>> spec = sitscad.load("templates/single_coil.yaml")
    >>> sorted(sitscad.measure(spec, ["rp", "inductance"]).values)
    ['inductance', 'rp']
    """
    names = _measures_of(level, measures)
    return evaluate_design(spec, names) if level == FULL else screen_designs([spec], names)[0]


@checked_arguments
def sweep(
    spec: SensorSpec,
    ranges: Mapping[str, Sequence[Any]],
    measures: Sequence[str] | None = None,
    *,
    level: str = SCREEN,
    jobs: int | None = 1,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> SweepTable:
    """Return a table of measures for every combination of the values in `ranges`. The last key changes fastest.

    Parameters
    ----------
    spec
        The base spec of the designs.
    ranges
        Values by key, as in `SensorSpec.replace`: numbers in SI units (metres), or texts with their unit.
    measures
        Names of measures (``sitscad measures`` lists them). If None, all measures of the level except ranges, sigmas
        and the yield.
    level
        ``"screen"`` is quick, ``"full"`` computes everything that `check` computes.
    jobs
        Number of processes. All processors if None.
    executor
        An object with a `submit`, used in place of processes.
    progress
        A function that is called with the number of finished designs and the number of all designs.

    Returns
    -------
    SweepTable
        One row per design. If a rule on the spec itself refuses a design, its row has no values and names the rule.

    Raises
    ------
    ValueError
        If there is no such level or measure, no range, an empty range, or if there are too many designs.
    SpecError
        If the spec has no such key, or the key cannot have such a value.

    Examples
    --------
    >>> import sitscad
    >>> coil = {"shape": "circle", "outer_diameter": 8, "turns": 14, "layers": 2,
    ...         "trace_width": "100 um", "trace_spacing": "100 um"}
    >>> spec = sitscad.SensorSpec.from_mapping(name="bench", coil=coil)
    >>> table = sitscad.sweep(spec, {"coil.turns": [12, 14]}, ["inductance"])
    >>> bool(table.values["inductance"][1] > table.values["inductance"][0])
    True
    """
    plain_values = {str(key): tuple(plain_data(list(values))) for key, values in ranges.items()}
    try:
        written = {key: [written_value(key, value) for value in values] for key, values in plain_values.items()}
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    table = sweep_as_written(
        spec.source, written, measures, level=level, jobs=jobs, executor=executor, progress=progress
    )
    return replace(table, keys=_columns(plain_values))


def sweep_as_written(
    source: SpecSource, ranges: Mapping[str, Sequence[Any]], measures: Sequence[str] | None = None, *,
    level: str = SCREEN, jobs: int | None = 1, executor: Executor | None = None, progress: Progress | None = None,
) -> SweepTable:
    """Return the table of `sweep` for values as in a YAML file: lengths without a unit are in millimetres."""
    names = _measures_of(level, measures)
    axes = {str(key): tuple(plain_data(list(values))) for key, values in ranges.items()}
    if not axes or not all(axes.values()):
        raise ValueError("a sweep takes at least one key, and at least one value of each")
    shape = tuple(map(len, axes.values()))
    if (total := int(np.prod(np.array(shape, dtype=object)))) > MOST_DESIGNS:
        raise ValueError(f"{total} designs; {MOST_DESIGNS} are the most of one sweep")
    base = Base.from_source(source)
    for key, values in axes.items():
        require_key(base, key, values)
    designs: list[Changes] = [tuple(zip(axes, point, strict=True)) for point in product(*axes.values())]
    evaluations = []
    with Workers(base, jobs, executor) as workers:
        for each in workers.evaluations(designs, names, level):
            evaluations.append(each)
            if progress is not None:
                progress(len(evaluations), total)
    return _table(base.path, level, axes, shape, names, evaluations)


def _measures_of(level: str, measures: Sequence[str] | None) -> tuple[str, ...]:
    if level not in (SCREEN, FULL):
        raise ValueError(f"the level is {SCREEN} or {FULL}, not {level!r}")
    names = checked_measure_names(measures if measures is None else tuple(measures), level)
    lacking = [name for name in names if level not in MEASURES[name].levels]
    if lacking:
        raise ValueError(f"{', '.join(lacking)}: only the level {FULL} has it")
    return names


def _table(
    path: str, level: str, axes: Mapping[str, tuple[Any, ...]], shape: tuple[int, ...], names: Sequence[str],
    evaluations: Sequence[Evaluation],
) -> SweepTable:
    nothing = (np.nan, np.nan)
    pairs = {name: np.array([each.values.get(name, nothing) for each in evaluations]) for name in names}
    return SweepTable(
        path, level, _columns(axes), {name: pair[:, 0] for name, pair in pairs.items()},
        {name: pair[:, 1] for name, pair in pairs.items()}, tuple(each.verdict for each in evaluations),
        tuple(each.refused_by for each in evaluations), tuple(each.warned_by for each in evaluations), shape,
    )


def _columns(axes: Mapping[str, tuple[Any, ...]]) -> dict[str, tuple[Any, ...]]:
    """Return the values of each key for all rows of a table, from the values on its axes."""
    points = list(product(*axes.values()))
    return {key: tuple(point[k] for point in points) for k, key in enumerate(axes)}


def parse_range(text: str) -> tuple[str, tuple[Any, ...]]:
    """Return the key and the values in ``coil.turns=6:12:13`` or ``coil.layers=2,4``. Raises `RangeError`."""
    key, equals, written = text.partition("=")
    if not equals or not key.strip() or not written.strip():
        raise RangeError(f"{text!r} is no KEY=FIRST:LAST:COUNT and no KEY=VALUE,VALUE", "like coil.turns=6:12:13")
    parts = written.split(":")
    if len(parts) == 1:
        return key.strip(), tuple(plain_value(value.strip()) for value in written.split(","))
    if len(parts) != 3 or not parts[2].strip().isdecimal() or len(parts[2].strip()) > 9:
        raise RangeError(f"{text!r}: FIRST:LAST:COUNT is wanted", "like 6:12:13 or 70um:110um:9")
    return key.strip(), values_by_count(parts[0].strip(), parts[1].strip(), int(parts[2]))


def value_text(name: str, value: float, digits: int = 4) -> str:
    """Return a value of a measure as text with its unit. A dash if it is not finite."""
    return quantity(value, MEASURES[name].unit, digits)


def sweep_text(table: SweepTable) -> str:
    """Return one line per design: keys, values with error bounds, verdict, and the rules that refuse or warn."""
    head = [*table.keys, *table.values, "verdict", "refused by", "warned by"]
    rows = [
        [*(str(values[k]) for values in table.keys.values()),
         *(_value_with_error(name, float(values[k]), float(table.errors[name][k])) for name,
           values in table.values.items()),
         table.verdict[k], ", ".join(table.refused_by[k]), ", ".join(table.warned_by[k])]
        for k in range(len(table))
    ]
    return "\n".join(aligned_lines([head, *rows])) + "\n"


def _value_with_error(name: str, value: float, error: float) -> str:
    """Return a value with its relative error bound, like ``1.263 kohm +-11%``."""
    share = 100.0 * error / abs(value) if value and error > 0.0 else 0.0
    return f"{value_text(name, value)} +-{float(f'{share:.2g}'):g}%" if share else value_text(name, value)


def sweep_csv(table: SweepTable) -> str:
    """Return a CSV file with one row per design, and columns by key and measure. Missing values are empty."""
    named = [title for name in table.values for title in (name, f"{name}.error")]
    rows: list[list[object]] = [[*table.keys, *named, "verdict", "refused_by", "warned_by"]]
    for k in range(len(table)):
        keys = [values[k] for values in table.keys.values()]
        pairs = [number_cell(float(of[name][k])) for name in table.values for of in (table.values, table.errors)]
        rules = " ".join(table.refused_by[k]), " ".join(table.warned_by[k])
        rows.append([*keys, *pairs, table.verdict[k], *rules])
    return csv_text(rows)


def sweep_json(table: SweepTable) -> str:
    """Return the table as JSON by columns, with units."""
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
    """Return arrays by key and measure as an NPZ file, with ``NAME.error`` for error bounds.

    Equal tables give equal bytes.
    """
    arrays: dict[str, Any] = {key: np.array(values) for key, values in table.keys.items()}
    for name, values in table.values.items():
        arrays |= {name: values, f"{name}.error": table.errors[name]}
    arrays["verdict"] = np.array(table.verdict)
    arrays["refused_by"] = np.array([" ".join(rules) for rules in table.refused_by])
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


PANEL = (140.0, 80.0)
"""Width and height (mm) of one picture on a sheet."""


def sweep_svg(table: SweepTable) -> str:
    """Return a picture of each measure as SVG.

    For one key, it is a curve with a band for the error. For two keys, it is a map of coloured cells without
    interpolation, with the borders of the cells that each rule refuses. Raises ValueError for more keys.
    """
    if len(table.keys) > 2:
        raise ValueError(f"a picture has one key or two, not {len(table.keys)}; .csv takes any number")
    names = [name for name, values in table.values.items() if np.isfinite(values).any()]
    if not names:
        raise ValueError("no design of this sweep has a figure that could be drawn")
    width, height = PANEL
    sheet = Sheet(f"Sweep of {', '.join(table.keys)}", (width, height * len(names)))
    for k, name in enumerate(names):
        draw = _curve_plotter(table, name) if len(table.keys) == 1 else _map_plotter(table, name)
        draw_figure(sheet, (4.0, height * (len(names) - 1 - k) + 2.0, width - 8.0, height - 4.0), draw)
    return svg(sheet)


def chart_scale(name: str, values: Array) -> tuple[float, str]:
    """Return the factor and the unit of a measure in drawings, chosen by the largest of the values."""
    finite = np.abs(values[np.isfinite(values)])
    most = float(finite.max()) if finite.size else 0.0
    unit = value_text(name, most).partition(" ")[2] if most else MEASURES[name].unit
    number = float(value_text(name, most).partition(" ")[0]) if most else 1.0
    return (10.0 ** round(math.log10(number / most)) if most else 1.0), unit


def _axis_positions(values: Sequence[Any]) -> tuple[Array, list[str] | None]:
    """Return the positions of values on an axis, and their labels. None for labels if all are numbers with one unit."""
    matches = [re.fullmatch(r"\s*([-+.\deE]+)\s*([^\d]*)", str(value)) for value in values]
    units = {match[2] for match in matches if match is not None}
    if all(matches) and len(units) == 1:
        numbers = np.array([float(match[1]) for match in matches if match is not None])
        if len(set(numbers.tolist())) == len(numbers):
            return numbers, None
    return np.arange(len(values), dtype=float), [str(value) for value in values]


def measure_title(name: str, unit: str) -> str:
    """Return a measure's name with its unit in parentheses."""
    return f"{name} ({unit})" if unit else name


def _axis_label(key: str, values: Sequence[Any]) -> str:
    unit = re.fullmatch(r"\s*[-+.\deE]+\s*([^\d]+)", str(values[0]))
    return f"{key} ({unit[1].strip()})" if unit else key


def _curve_plotter(table: SweepTable, name: str) -> Callable[[Any], None]:
    (key, written), = table.keys.items()

    def draw(figure: Any) -> None:
        axes, (at, names) = figure.subplots(), _axis_positions(written)
        factor, unit = chart_scale(name, table.values[name])
        values, errors = factor * table.values[name], factor * table.errors[name]
        failed = np.array([verdict == FAILS for verdict in table.verdict])
        (line,) = axes.plot(at, values, marker="o", markersize=2.5, linestyle="-" if names is None else "")
        axes.fill_between(at, values - errors, values + errors, alpha=0.18, color=line.get_color(), linewidth=0.0,
                          label="what it may be off by")
        if failed.any():
            axes.plot(at[failed], values[failed], marker="x", markersize=6.0, linestyle="", color="#a02020",
                      label="refused by a rule")
        axes.set(xlabel=_axis_label(key, written), ylabel=measure_title(name, unit))
        if names is not None:
            axes.set_xticks(at, names)
        axes.legend()

    return draw


def _map_plotter(table: SweepTable, name: str) -> Callable[[Any], None]:
    (first, firsts), (second, seconds) = table.keys.items()
    rows, columns = table.shape
    down, across = firsts[::columns], seconds[:columns]

    def draw(figure: Any) -> None:
        axes, (x, x_names), (y, y_names) = figure.subplots(), _axis_positions(across), _axis_positions(down)
        factor, unit = chart_scale(name, table.values[name])
        values = factor * table.values[name].reshape(rows, columns)
        xs, ys = _cell_borders(x), _cell_borders(y)
        mesh = axes.pcolormesh(xs, ys, np.ma.masked_invalid(values), cmap="viridis", linewidth=0.0)
        figure.colorbar(mesh, ax=axes, label=measure_title(name, unit))
        rules, titles = sorted({rule for refused in table.refused_by for rule in refused}), rule_titles()
        for k, rule in enumerate(rules):
            refused = np.array([rule in each for each in table.refused_by]).reshape(rows, columns)
            _draw_refused_edge(axes, refused, xs, ys, titles.get(rule, rule),
                               REFUSAL_LINE_COLOURS[k % len(REFUSAL_LINE_COLOURS)])
        axes.set(xlabel=_axis_label(second, across), ylabel=_axis_label(first, down))
        for names, ticks, at in ((x_names, axes.set_xticks, x), (y_names, axes.set_yticks, y)):
            if names is not None:
                ticks(at, names)
        if rules:
            figure.legend(loc="outside upper left", title="refused within", ncols=3, facecolor="#c8cdd2", frameon=True)

    return draw


def rule_titles() -> dict[str, str]:
    """Return the text "ID NAME" of each rule by its id."""
    return {rule.id: f"{rule.id} {rule.name}" for rule in all_rules()}


REFUSAL_LINE_COLOURS = ("#d02020", "#ffffff", "#ff9a1f", "#111111", "#e05ab0", "#8ae0ff")
"""Line colours of the refused regions in the plot of a sweep over two keys, one per rule, repeated in this order."""


def _cell_borders(middles: Array) -> Array:
    """Return the n + 1 borders of cells around n ascending values.

    Inner borders are halfway between neighbouring values. Outer borders are at equal distance beyond the first and the
    last value.
    """
    if len(middles) == 1:
        return np.array([middles[0] - 0.5, middles[0] + 0.5])
    between = (middles[1:] + middles[:-1]) / 2.0
    return np.concatenate([[2.0 * middles[0] - between[0]], between, [2.0 * middles[-1] - between[-1]]])


def _draw_refused_edge(axes: Any, refused: Flags, xs: Array, ys: Array, rule: str, colour: str) -> None:
    """Draw the border of the cells that a rule refuses.

    `refused` has a flag for each cell, and `xs` and `ys` are the borders of the cells. The line follows the cells,
    because designs between them are unknown.
    """
    inside = np.pad(refused, 1)
    lines: list[tuple[list[float], list[float]]] = []
    for i, k in zip(*np.nonzero(inside[1:, 1:-1] != inside[:-1, 1:-1]), strict=True):
        lines.append(([xs[k], xs[k + 1]], [ys[i], ys[i]]))
    for i, k in zip(*np.nonzero(inside[1:-1, 1:] != inside[1:-1, :-1]), strict=True):
        lines.append(([xs[k], xs[k]], [ys[i], ys[i + 1]]))
    for n, (across, up) in enumerate(lines):
        axes.plot(across, up, color=colour, linewidth=1.6, label=rule if n == 0 else "_nolegend_")


def _encoded(write: Callable[[SweepTable], str]) -> Callable[[SweepTable], bytes]:
    return lambda table: write(table).encode("utf-8")


SWEEP_FORMATS: Mapping[str, Callable[[SweepTable], str]] = {"text": sweep_text, "csv": sweep_csv, "json": sweep_json}
"""Output formats of `sweep`: functions of the table, by name."""

SWEEP_FILES: Mapping[str, Callable[[SweepTable], bytes]] = {
    ".csv": _encoded(sweep_csv), ".json": _encoded(sweep_json), ".npz": sweep_npz, ".svg": _encoded(sweep_svg),
}
"""File formats of `sweep -o`: functions of the table, by file ending."""


def measures_text() -> str:
    """Return one line per measure: name, unit, levels, meaning and needed parts."""
    rows = [
        [row.name, row.unit or "-", ", ".join(row.levels),
         row.meaning + (f" (needs {row.needs_text})" if row.needs else "")]
        for row in MEASURES.values()
    ]
    table = "\n".join(aligned_lines([["measure", "unit", "levels", "meaning"], *rows]))
    return f"{table}\n\n{NO_SCREEN[0].upper()}{NO_SCREEN[1:]}: other designs are judged in full.\n"


def measures_json() -> str:
    """Return the properties of all measures as JSON."""
    rows = [
        {"name": row.name, "unit": row.unit, "meaning": row.meaning, "levels": list(row.levels),
         "needs": row.needs_text}
        for row in MEASURES.values()
    ]
    return to_json({"sitscad": __version__, "measures": rows})


MEASURE_FORMATS: Mapping[str, Callable[[], str]] = {"text": measures_text, "json": measures_json}
"""Output formats of `measures`."""
