"""What a calibration makes of a unit in which something is hidden: the true error, the stated one, what is said of it.

    python tests/validation/hidden_faults.py [--write]

One simulated unit of `grasper_4layer` (its errors those of a usual one) is read at the eight loads of its plan, by the
command's own way through a table; every fault is put into the unit, into its bench or into the table. True errors are
those of its map at 25 other loads, solved pose by pose, without noise, rms over them. With `--write` the table of
docs/calibration.md is made of it.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import sitscad
from sitscad.calibration import Calibration, calibrate
from sitscad.calibration.calibration import simulated_sensors
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import draw_units
from sitscad.spec.sensor import SensorSpec
from tests.oracles.bench import simulated

Array = NDArray[np.float64]
Table = tuple[list[str], list[list[float]]]

ROOT = Path(__file__).parents[2]
PAGE, BLOCK = ROOT / "docs" / "calibration.md", "hidden_faults.py"
TEMPLATE = "grasper_4layer"
SEED, USUAL, ASKED, SKIPPED = 77, 0.7, 25, 700
HEAD = ("hidden fault", "true error, normal", "true error, shear", "stated error, normal", "stated error, shear",
        "message")
G = 9.80665


@dataclass(frozen=True)
class Fault:
    """Something that is hidden: errors of the unit's own (by unknown, in its unit, beside the usual ones), another
    spec than the one that is calibrated, a target that is free to tilt, or what the table says instead.
    """

    name: str
    own: tuple[tuple[str, float], ...] = ()
    spec: Callable[[SensorSpec], SensorSpec] | None = None
    is_free: bool = False
    table: Callable[[Table], Table] | None = None


def _of_pad(**changes: float) -> Callable[[SensorSpec], SensorSpec]:
    def changed(spec: SensorSpec) -> SensorSpec:
        pad = spec.elastomer
        assert pad is not None
        exponent = pad.material.ogden_exponent + changes["exponent"]
        return replace(spec, elastomer=replace(pad, material=replace(pad.material, ogden_exponent=exponent)))

    return changed


def _of_target(thinner: float = 1.0, width: float | None = None) -> Callable[[SensorSpec], SensorSpec]:
    def changed(spec: SensorSpec) -> SensorSpec:
        target = spec.target
        assert target is not None
        size = target.size if width is None else (width, width)
        return replace(spec, target=replace(target, thickness=target.thickness / thinner, size=size))

    return changed


def _fewer_turns(spec: SensorSpec) -> SensorSpec:
    return replace(spec, coil=replace(spec.coil, turns=spec.coil.turns - 1.0))


def _scaled(first: str, share: float) -> Callable[[Table], Table]:
    """The table with all loads of an axis multiplied."""

    def changed(table: Table) -> Table:
        head, rows = table
        places = [k for k, name in enumerate(head) if name.startswith(first)]
        return head, [[value * share if k in places else value for k, value in enumerate(row)] for row in rows]

    return changed


def _exchanged(table: Table) -> Table:
    head, rows = table
    return head, [[*row[:-2], row[-1], row[-2]] for row in rows]


def _in_kgf(table: Table) -> Table:
    head, rows = table
    return head, [[value / G if head[k].endswith("_N") else value for k, value in enumerate(row)] for row in rows]


FAULTS = (
    Fault("nothing"),
    Fault("target turned by 3 degrees", (("twist", math.radians(3.0)),)),
    Fault("target turned by 10 degrees", (("twist", math.radians(10.0)),)),
    Fault("target tilted by 3 degrees across the jaw", (("tilt_y", math.radians(3.0)),)),
    Fault("target tilted by 3 degrees along it", (("tilt_x", math.radians(3.0)),)),
    Fault("pad a fifth thicker", (("gap", 0.2),)),
    Fault("pad a fifth thinner", (("gap", -0.2),)),
    Fault("modulus twice as large", (("modulus", math.log(2.0)),)),
    Fault("modulus half as large", (("modulus", -math.log(2.0)),)),
    Fault("shear goes a third further under full load", (("softening", math.log(4.0 / 3.0)),)),
    Fault("exponent of the pad's law higher by one", spec=_of_pad(exponent=1.0)),
    Fault("exponent of the pad's law lower by one", spec=_of_pad(exponent=-1.0)),
    Fault("clock 0.5 % fast", (("clock", 0.005),)),
    Fault("one capacitor 5 % off", (("capacitor.C1", 0.05),)),
    Fault("both capacitors 5 % off", (("capacitor.C1", 0.05), ("capacitor.C2", 0.05))),
    Fault("foil half as thick", spec=_of_target(thinner=2.0)),
    Fault("target 3 mm wide", spec=_of_target(width=3e-3)),
    Fault("a turn fewer", spec=_fewer_turns),
    Fault("free to tilt, calibrated as level", is_free=True),
    Fault("channels exchanged", table=_exchanged),
    Fault("sign of shear", table=_scaled("shear", -1.0)),
    Fault("shear loads half of what the table says", table=_scaled("shear", 2.0)),
    Fault("normal loads half of what the table says", table=_scaled("normal", 2.0)),
    Fault("loads in kgf under N", table=_in_kgf),
)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", action="store_true", help="make the table of docs/calibration.md")
    parser.add_argument("--only", default="", help="the faults whose name has this in it")
    given = parser.parse_args()
    lines = ["| " + " | ".join(HEAD) + " |", "|---|---|---|---|---|---|"]
    for cells in rows(given.only):
        lines.append("| " + " | ".join(cells) + " |")
        print(lines[-1], flush=True)
    if given.write:
        begins, ends = (f"<!-- {BLOCK} {which} -->\n" for which in ("begins", "ends"))
        before, rest = PAGE.read_text(encoding="utf-8").split(begins)
        block = "\n".join(lines) + "\n"
        PAGE.write_text(before + begins + block + ends + rest.split(ends)[1], encoding="utf-8")


def rows(only: str = "") -> Iterator[tuple[str, ...]]:
    """A row of the table for every fault, or for `only` those that are named so."""
    design = sitscad.Design(sitscad.load(ROOT / "templates" / f"{TEMPLATE}.yaml"))
    loads = calibrate(design).plan
    assert loads is not None
    sensors = simulated_sensors(design.response)
    usual = USUAL * draw_units(sensors.unknowns, 1, SEED)[0]
    for fault in (item for item in FAULTS if only in item.name):
        truth, own = of_fault(design, sensors, fault, usual)
        bench = simulated(truth, own, loads.loads, np.random.default_rng(SEED))
        axes, counts = sensors.range.axes, np.rint(sensors.conversion.counts(bench.frequency))
        assert bench.loads is not None
        head = [*(f"{axis}_N" for axis in axes), *(f"{coil}_counts" for coil in sensors.coils)]
        table = head, np.hstack([bench.loads[:, sensors.range.columns], counts]).tolist()
        if fault.table is not None:
            table = fault.table(table)
        yield fault.name, *told(design, truth, own, table)


def of_fault(design: sitscad.Design, sensors: Sensors, fault: Fault, usual: Array) -> tuple[Sensors, Array]:
    """The sensors that a unit with a fault is one of, and its errors."""
    names, own = [item.name for item in sensors.unknowns], usual.copy()
    assert design.spec.elastomer is not None
    for name, value in fault.own:
        own[names.index(name)] = value * (design.spec.elastomer.thickness if name == "gap" else 1.0)
    if fault.spec is not None:
        return simulated_sensors(sitscad.Design(fault.spec(design.spec)).response), own
    return (simulated_sensors(design.response, is_held=False) if fault.is_free else sensors), own


def told(design: sitscad.Design, truth: Sensors, own: Array, table: Table) -> tuple[str, ...]:
    """True and stated errors by axis, and what is said, of a unit's table."""
    head, body = table
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.csv"
        cells = ([*(f"{value:.9g}" for value in row[:-2]), *(f"{value:.0f}" for value in row[-2:])] for row in body)
        path.write_text("\n".join(",".join(row) for row in [head, *cells]) + "\n", encoding="utf-8")
        try:
            result = calibrate(design, str(path))
        except ValueError as error:
            return (
                "",
                "",
                "",
                "",
                "refused: " + " ".join(str(error).split(" ")[1:]).partition(": a typing")[0].partition("?")[0],
            )
    tried = np.vstack([np.zeros((1, 3)), result.sensors.range.evenly_spread_loads(ASKED, SKIPPED)])
    read = truth.frequencies_under(own, tried, exact=True)
    off = result.map(read[1:], read[0]) - tried[1:, result.sensors.range.columns]
    errors = np.concatenate([np.sqrt(np.mean(off**2, axis=0)), result.map.error]) / np.tile(result.map.full_scale, 2)
    return *(f"{100.0 * error:.2g} %" for error in errors), "; ".join(said(result))


def said(found: Calibration) -> Iterator[str]:
    """What its notes say of a fault, in short."""
    for note in found.remarks:
        yield note.partition(",")[0].rpartition("/")[2]  # of a path its file
    assert found.fit is not None
    for note in found.notes:
        if note.startswith("unusual: "):
            yield note.removeprefix("unusual: ").partition("?")[0]


if __name__ == "__main__":
    main()
