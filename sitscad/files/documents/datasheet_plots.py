"""Plots of the data sheet: coils, combinations of coils, working range, and errors by cause."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.estimates.performance.curves import Curve, Curves
from sitscad.estimates.performance.tables import FROM_UNIT_TO_UNIT
from sitscad.estimates.performance_values import AXIS_WORDS, FORCES, SHOWN, Performance, load_unit

NAMES, SHEARS = AXIS_WORDS, FORCES[1:]
Draw = Callable[[Any], None]

NANO = 1e9
BAND = 0.18  # Opacity of a one-sigma band

DIGITS = 6  # Significant digits of plotted values, so that rounding on other machines changes no plot


@record(eq=False)
class Plot:
    """Plot with its caption, its size (mm), and the function that draws it on a matplotlib figure."""

    caption: str
    size: tuple[float, float]
    draw: Draw


def sensor_plots(curves: Curves, points: Sequence[Performance], cell: str = "") -> list[Plot]:
    """Return all plots of a sensor, the `WIDE` ones first. `cell` names the cell of the curves; empty without cells."""
    beyond = f" {BEYOND}" if any(float(np.abs(curve.forces).max()) > curves.validated_shear for curve in curves.shears
                              if curve.axis in SHEARS) else ""
    side = " and ".join(dict.fromkeys(NAMES[curve.axis].split()[0] for curve in curves.shears))
    of = f"{cell.capitalize()}, which has the least signal. " if cell else ""
    lone = len(curves.coils) == 1
    what = "The coil over the normal force; band:" if lone else (
        f"Each coil over the normal force, and over {side} under half of it; bands:")
    plots = [Plot(f"{of}{what} one sigma from unit to unit, tared, not calibrated. Inductance is what firmware/ "
                  "computes from a reading, 1 / (C (2 pi f)^2): the coil's own capacitance is in it.", WIDE,
                  partial(_draw_coils, curves, cell and f"{cell}, "))]
    if not lone:
        plots.append(Plot(f"{of}Combinations of the coils: their sum over the normal force, and their difference over "
                          f"{side} under no, half and full normal force." + beyond,
                          WIDE, partial(_draw_combinations, curves)))
    if curves.ranges:
        plots.append(Plot(f"{of}The working range: where the readings go. Lines of equal normal force (blue) and of "
                          f"equal {side} (orange); where lines of one colour cross, no map tells the loads apart."
                          + (f" {BEYOND_LINES}" if beyond else ""), NARROW, partial(_draw_range, curves)))
    worst = ", by each cause that of the cell which is worst in it" if cell else ""
    plots.append(Plot(f"One sigma of error at full load by cause, of full scale, on any unit alike{worst}; the table "
                      "says what differs from unit to unit.", NARROW, partial(_draw_errors, points[-1])))
    return plots


WIDE, NARROW = (262.0, 72.0), (130.0, 100.0)  # Sizes of plots (mm): of curves, and of all others
BEYOND = "Shaded, above too: shear at which the pad's law is extrapolated, beyond half its thickness."
BEYOND_LINES = "Dashed: the pad's law is extrapolated there, the shear beyond half its thickness."
EXTRAPOLATED = "extrapolated"


def _shade_extrapolation(axes: Any, curve: Curve, limit: float) -> None:
    """Shade the shear forces beyond `limit` (N), at which the law of the pad's stiffness is extrapolated.

    The legend has one entry for all shaded areas.
    """
    most, label = float(np.abs(curve.forces).max()), EXTRAPOLATED
    if curve.axis not in SHEARS or most <= limit:
        return
    for low, high in ((-most, -limit), (limit, most)):
        axes.axvspan(low, high, color="#8a939b", alpha=0.22, linewidth=0.0, label=label, zorder=0.5)
        label = "_nolegend_"


def coil_difference(curves: Curves, axis: str) -> tuple[str, Array]:
    """Return the difference of coil inductances that measures a shear or a moment, as text and as weights (coils).

    The weights form the mean of the coils on one side of the array's middle, minus the mean of the coils on the other
    side. `axis` is the name of the shear or the moment.
    """
    places = curves.places[:, 0 if axis in ("shear_x", "moment_y") else 1]
    weights = np.where(np.abs(places) < 1e-9, 0.0, -places / np.maximum(np.abs(places), 1e-12))
    low, high = ([name for name, w in zip(curves.coils, weights, strict=True) if w * sign > 0.0] for sign in (1, -1))
    weights = np.where(weights > 0.0, weights / max(len(low), 1), weights / max(len(high), 1))
    return f"{_mean_text(low)} - {_mean_text(high)}", weights


def _mean_text(names: Sequence[str]) -> str:
    joined = "+".join(f"L{name.removeprefix('C')}" for name in names)
    return joined if len(names) == 1 else f"({joined})/{len(names)}"


def _sum_text(curves: Curves) -> str:
    return " + ".join(f"L{name.removeprefix('C')}" for name in curves.coils)


def _rounded(values: Array) -> Array:
    scale = max(float(np.abs(values).max()), 1e-300)
    return np.asarray(np.round(values / scale, DIGITS) * scale)


def _draw_coils(curves: Curves, of: str, figure: Any) -> None:
    """Draw each coil's inductance over the normal force, and over shear under half the normal force.

    `of` is the beginning of each panel's title.
    """
    shown = [curves.normal, *(curve for k, curve in enumerate(curves.shears) if k % 3 == 1)]  # half the normal force
    names = "each coil" if len(curves.coils) > 1 else _sum_text(curves)
    for axes, curve in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
        for k, name in enumerate(curves.coils):
            dashes = "--" if k % 2 else "-"  # coils with equal readings (by symmetry) stay visible
            _draw_line(axes, curve, NANO * curve.inductance[:, k], NANO * curve.sigma[:, k], f"L{name[1:]}", dashes)
        _shade_extrapolation(axes, curve, curves.validated_shear)
        under = "" if curve.axis == "normal" else f", {curve.normal:.3g} N normal"
        axes.set(xlabel=_axis_label(curve.axis), ylabel="inductance (nH)", title=f"{of}{names}{under}")
        if len(curves.coils) > 1:
            axes.legend()


def _draw_combinations(curves: Curves, figure: Any) -> None:
    """Draw the sum of the coils' inductances over the normal force, and their differences over each shear or moment."""
    kinds = list(dict.fromkeys(curve.axis for curve in curves.shears))
    first, *panels = figure.subplots(1, 1 + len(kinds), squeeze=False)[0]
    total, sigma_total = curves.normal.inductance.sum(axis=1), np.hypot.reduce(curves.normal.sigma, axis=1)
    _draw_line(first, curves.normal, NANO * total, NANO * sigma_total, "")
    first.set(xlabel="normal (N)", ylabel="nH", title=_sum_text(curves))
    for axes, kind in zip(panels, kinds, strict=True):
        title, weights = coil_difference(curves, kind)
        for plotted in (curve for curve in curves.shears if curve.axis == kind):
            sigma = np.sqrt((plotted.sigma * weights) ** 2 @ np.ones(len(weights)))
            label = f"{plotted.normal:.3g} N normal"
            _draw_line(axes, plotted, NANO * plotted.inductance @ weights, NANO * sigma, label)
        _shade_extrapolation(axes, plotted, curves.validated_shear)
        axes.set(xlabel=_axis_label(kind), ylabel="nH", title=title)
        axes.legend()


def _axis_label(axis: str) -> str:
    return f"{NAMES[axis]} ({SHOWN[load_unit(axis)][1]})"


def _draw_line(axes: Any, curve: Curve, values: Array, sigma: Array, label: str, dashes: str = "-") -> None:
    values, sigma = _rounded(values), _rounded(sigma)
    forces = curve.forces * SHOWN[load_unit(curve.axis)][0]
    (line,) = axes.plot(forces, values, label=label, linestyle=dashes)
    axes.fill_between(forces, values - sigma, values + sigma, alpha=BAND, color=line.get_color(), linewidth=0.0)


def _draw_range(curves: Curves, figure: Any) -> None:
    """Draw the working range: the sum of the coils' inductances over their difference (nH).

    There is one panel for each shear or moment. Along a blue line the normal force is constant, along an orange line
    the shear force or the moment.
    """
    panels = figure.subplots(1, len(curves.ranges), squeeze=False)[0]
    for axes, (kind, normal, shear, inductance) in zip(panels, curves.ranges, strict=True):
        label, weights = coil_difference(curves, kind)
        apart = _rounded(NANO * inductance @ weights)
        total = _rounded(NANO * inductance.sum(axis=2))
        for k, force in enumerate(normal):
            width = 0.9 if k in (0, len(normal) - 1) else 0.45
            for part, dashes in _split_at_limit(shear, curves.validated_shear if kind in SHEARS else np.inf):
                line = (np.interp(part, shear, values[k]) for values in (apart, total))
                axes.plot(*line, color="#1f5fa8", linewidth=width, linestyle=dashes)
            if k in (0, len(normal) - 1):
                axes.annotate(f"{force:.3g} N", (apart[k, -1], total[k, -1]), color="#1f5fa8")
        for k in range(len(shear)):
            axes.plot(apart[:, k], total[:, k], color="#c4602b", linewidth=0.9 if 2 * k + 1 == len(shear) else 0.45,
                      linestyle="-" if kind not in SHEARS or abs(shear[k]) <= curves.validated_shear else "--")
        axes.margins(x=0.2)  # room for the words at the ends of the lines
        axes.set(xlabel=f"{label} (nH)", ylabel=f"{_sum_text(curves)} (nH)", title=f"normal and {NAMES[kind]}")


def _split_at_limit(shear: Array, limit: float) -> Iterator[tuple[Array, str]]:
    """Yield the shear forces (N) and the line style of each part of a line: solid up to `limit` (N), dashed beyond."""
    ends = np.clip([-limit, limit], shear[0], shear[-1])
    yield np.array([ends[0], *shear[np.abs(shear) < limit], ends[1]]), "-"
    for low, high in ((shear[0], ends[0]), (ends[1], shear[-1])):
        if low < high:
            yield np.array([low, *shear[(shear > low) & (shear < high)], high]), "--"


def _draw_errors(full: Performance, figure: Any) -> None:
    """Draw the errors at full load as bars, one for each cause and axis, in per cent of full scale."""
    axes, names = figure.subplots(), list(full.axes)
    causes = [cause for cause in full.axes[names[0]].errors if cause not in FROM_UNIT_TO_UNIT]
    for k, name in enumerate(names):
        axis = full.axes[name]
        percentages = [100.0 * max(float(f"{axis.errors[cause]:.4g}") / axis.full_scale, 1e-6) for cause in causes]
        at = np.arange(len(causes)) + (k - 0.5 * (len(names) - 1)) * 0.8 / len(names)
        axes.barh(at, percentages, 0.8 / len(names), left=LEAST, label=NAMES[name])
    axes.set_axisbelow(True)
    axes.set_yticks(np.arange(len(causes)), causes)
    axes.set(xscale="log", xlim=(LEAST, 1000.0), xlabel="of full scale (%)")
    axes.set_xticks([0.01, 0.1, 1.0, 10.0, 100.0, 1000.0], ["0.01", "0.1", "1", "10", "100", "1000"])
    axes.minorticks_off()
    axes.invert_yaxis()
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(names))  # bars reach every corner


LEAST = 0.003  # Left end of the error bars (per cent)
