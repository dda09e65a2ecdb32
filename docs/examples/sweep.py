"""Sweep turns and track width, and plot inductance, its change under the required force, and Rp.

    python docs/examples/sweep.py [SPEC] [PICTURE.png]

Every point is a separate spec. Designs that cannot be wound are omitted, and their reason is printed.
"""

import sys

import sitscad

TURNS = (4.5, 5.5, 6.5, 7.5, 8.5)
WIDTHS = ("80 um", "100 um", "120 um")


def swept(spec: sitscad.SensorSpec) -> list[dict[str, float | str]]:
    """Return a row for each valid design: keys, inductance at rest, its change under force, parallel resistance."""
    rows: list[dict[str, float | str]] = []
    for width in WIDTHS:
        for turns in TURNS:
            try:
                changed = spec.replace({"coil.turns": turns, "coil.trace_width": width})
            except sitscad.SpecError as error:
                print(f"{turns:g} turns of {width}: {error.findings[0].message}")
                continue
            states = sitscad.estimate(sitscad.lay_out(changed)).coils[0].states
            rest, pressed = states["rest"], states["pressed"]
            rows.append(
                {
                    "width": width,
                    "turns": turns,
                    "inductance_H": rest.inductance,
                    "change": pressed.inductance / rest.inductance - 1.0,
                    "parallel_resistance_ohm": rest.parallel_resistance,
                }
            )
    return rows


def plotted(rows: list[dict[str, float | str]], picture: str) -> None:
    """Plot three curves over the turns for each track width."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    shown = (("inductance_H", 1e6, "inductance (uH)"), ("change", 100.0, "change under force (%)"),
             ("parallel_resistance_ohm", 1e-3, "Rp at rest (kohm)"))
    figure, axes = pyplot.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
    for axis, (key, factor, label) in zip(axes, shown, strict=True):
        for width in WIDTHS:
            mine = [row for row in rows if row["width"] == width]
            axis.plot([row["turns"] for row in mine], [factor * float(row[key]) for row in mine], "o-", label=width)
        axis.set(xlabel="turns a layer", ylabel=label)
        axis.grid(alpha=0.3)
    axes[0].legend(title="track")
    figure.savefig(picture, dpi=120)
    pyplot.close(figure)


def main() -> list[dict[str, float | str]]:
    """Sweep the spec of the command line and plot the result."""
    path, picture = [*sys.argv[1:], *("templates/three_axis_pad.yaml", "sweep.png")[len(sys.argv) - 1 :]][:2]
    rows = swept(sitscad.load(path))
    plotted(rows, picture)
    return rows


if __name__ == "__main__":
    main()
