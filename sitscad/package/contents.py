"""Contents of a package: a design, its findings, estimates for board tests, inputs of stages, calibration files.

If a value of the spec changes, the stages that read it are made again. `UNREAD` lists values that a stage does not
read. A test proves each entry: it changes the value and compares every byte of the stage. Otherwise a package could
contain files that do not belong to its spec.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import field, fields
from functools import cached_property
from pathlib import Path

from sitscad.assembly.places.motions import ROTATIONS
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.finding import Severity
from sitscad.basics.record import memo, record, replace
from sitscad.basics.units import count_text
from sitscad.basics.version import __version__
from sitscad.calibration.calibration import Calibration, plan_calibration, with_temperatures
from sitscad.checks.assembly.fit import findings_on_solids, rules_in_fit_file
from sitscad.checks.findings import CheckedSpec, checked_spec, to_json
from sitscad.checks.judging import all_rules
from sitscad.checks.judging import apply_rules as reviewed
from sitscad.checks.policy import Baseline, Policy, apply_policy, make_ignored_test
from sitscad.estimates import Estimates, estimate_layout
from sitscad.estimates.design import ROOM_TEMPERATURE, Design, at_room_temperature
from sitscad.estimates.loads.pad import NoResponse
from sitscad.estimates.states.steps import meter_readings
from sitscad.files.drawing.frame import FORCED
from sitscad.files.formats.calibration_header import header, program
from sitscad.files.formats.compensation_header import compensation_header
from sitscad.files.report.calibration import calibration_page, plan_card, plan_csv, plan_instructions
from sitscad.files.writer import is_felt
from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout.board import Layout
from sitscad.layout.panel import Panel, plan
from sitscad.package.folder import PackageError, write_file
from sitscad.package.manifest import NOT_WRITTEN
from sitscad.spec.sensor import SensorSpec


@record(eq=False)
class IncomingTests:
    """Panel of a design, and expected electrical values for the incoming tests of boards and coupons.

    They are computed at first use.
    """

    design: Design

    @cached_property
    def panel(self) -> Panel | None:
        """Panel in which the boards are ordered. None if boards are ordered singly."""
        return plan(self.design.layout)

    @cached_property
    def board(self) -> Estimates:
        """Electrical estimates of a board at 20 degrees Celsius (test temperature), with LCR meter readings."""
        estimates = at_room_temperature(self.design).estimates
        return replace(estimates, metered=meter_readings(self.design.layout, ROOM_TEMPERATURE))

    @cached_property
    def coupon(self) -> Estimates | None:
        """Electrical estimates of the panel's coupon in free air at 20 degrees Celsius. None if there is no coupon.

        A coupon is the first coil alone with solder pads.
        """
        if self.panel is None or self.panel.coupon is None:
            return None
        return estimate_layout(self.panel.coupon, temperature=ROOM_TEMPERATURE)  # measured on the bench


def incoming_tests(design: Design) -> IncomingTests:
    """Return the panel and the expected test values of a design. The object is cached with the design."""
    return memo(design, "incoming", lambda: IncomingTests(design))


@record
class Contents:
    """A design and its findings, as inputs of the functions that write files.

    Drawings use the spec without its text, so that they depend only on values. Only the findings and the report contain
    the file name.
    """

    design: Design
    policy: Policy = field(default_factory=Policy)
    baseline: Baseline | None = None
    measured: str = ""
    """Text of ``mount/fit.json``: dimensions measured on the solids. Empty if the file does not exist yet."""
    hints: str = "decisive"
    """Name of the limit on trial changes for hints, as in `sitscad.check`."""

    @cached_property
    def spec(self) -> SensorSpec:
        """Values of the spec, without its text."""
        return self.design.bare.spec

    @cached_property
    def layout(self) -> Layout:
        """Layout of the spec without its text."""
        return self.design.bare.layout

    @cached_property
    def estimates(self) -> Estimates:
        """Electrical estimates of the design."""
        return self.design.bare.estimates

    def value(self, name: str) -> object:
        """Return the value of the argument `name` of a writer.

        With cells, response and estimates are of the weakest cell.
        """
        return self.forced if name == "forced" else VALUES[name](self.design.bare)

    @cached_property
    def checked(self) -> CheckedSpec:
        """Findings of the check, each with its position in the spec's text."""
        # Cached in the design: dimensions measured on the solids later do not affect these rules
        source = self.design.spec.source
        is_ignored = make_ignored_test(source, all_rules(), self.policy)
        result = memo(
            self.design, f"reviewed with {self.hints} hints by {self.policy}",
            lambda: reviewed(self.design, self.hints, is_ignored=is_ignored),
        )
        document = json.loads(self.measured) if self.measured else {}
        decided = rules_in_fit_file(document)
        findings = checked_spec(
            self.design.spec.name, self.design.spec.source,
            (*result.findings, *findings_on_solids(document, self.design.spec.readout.device, self.design.spec.source)),
            tuple(each for each in result.not_checked if each.rule not in decided), result.signals, result.fit,
            result.closing, result.reached, result.board,
        )
        return apply_policy(findings, source, all_rules(), self.policy, self.baseline)

    @cached_property
    def forced(self) -> str:
        """Text of the warning not to order from this package, with its errors. Empty if the package has no errors."""
        return "" if self.checked.is_orderable else self.forced_note([])

    def forced_note(self, failures: list[str]) -> str:
        """Return the text of the warning in a package built in spite of errors. It lists errors and files not written.

        `failures` are messages about files that could not be written.
        """
        errors = [finding for finding in self.checked.findings if finding.severity == Severity.ERROR]
        silenced = self.checked.silenced
        how = "with --force" if errors else "with rules silenced"
        count = count_text(len(errors) + len(silenced), "error")
        lines = [
            f"The package {self.spec.name} was built {how} in spite of {count}.",
            "It is known not to meet its own checks. Do not order from it unless you know why:",
            "",
        ]
        lines += [f"- {finding.rule} {finding.name}: {finding.message}" for finding in errors]
        lines += [f"- {finding.rule} {finding.name} (silenced): {finding.message}" for finding in silenced]
        if failures:
            lines += [NOT_WRITTEN, "", *(f"- {failure}" for failure in failures)]
        return "\n".join([*lines, ""])

    @property
    def is_forced(self) -> bool:
        """Whether the package has the warning not to order from it."""
        return bool(self.forced)

    @cached_property
    def file_name(self) -> str:
        """The spec's file name without its folder."""
        return Path(self.design.spec.source.path).name


VALUES: dict[str, Callable[[Design], object]] = {
    "spec": lambda design: design.spec,
    "layout": lambda design: design.layout,
    "estimates": lambda design: design.estimates,
    "solids": lambda design: design.solids.alone,
    "whole": lambda design: design.solids.whole,
    "aids": lambda design: design.solids.aids,
    "panel": lambda design: incoming_tests(design).panel,
    "coupon_estimates": lambda design: incoming_tests(design).coupon,
    "bench_estimates": lambda design: incoming_tests(design).board,
    "response": lambda design: design.cells.weakest.response,
    "performance": lambda design: design.performance,
    "curves": lambda design: design.sensing.curves,
    "cell_table": lambda design: design.cells.skin.table,
}
"""Functions that compute a writer's argument from a design, by the argument's name (`Writer.takes`)."""

_ELECTRICAL = ("requirements", "readout", "source")

UNREAD: dict[str, tuple[str, ...]] = {
    "kicad": _ELECTRICAL,
    "laser": _ELECTRICAL,
    "mount": _ELECTRICAL,
    "mesh": _ELECTRICAL,
    "assembly": ("readout", "source"),
}
"""Top-level fields of the spec that a stage does not read. If only these change, the stage is not made again.

Converter, capacitor pads and soldered thermistor of the readout are read by all stages. Writers that take estimates
read all but the spec's text (`Writer.reads_numbers`).
"""


NEAR = 15e-3
"""Upper limit (m) of the distance to which a mount, an assembly jig or a mould extends from the board's body."""

BESIDE_TAIL = ("mount", "mesh")
"""Stages that depend on the tail only up to the distance `NEAR` from the body."""


def spec_inputs(stage: str, spec: SensorSpec, takes_numbers: bool = False) -> tuple[object, ...]:
    """Return the parts of a spec that a stage reads, in the order of the spec's fields.

    With `takes_numbers`, return the parts that the stage's writers of computed numbers read.
    """
    unread = ("source",) if takes_numbers else UNREAD.get(stage, ())
    parts = [getattr(spec, field.name) for field in fields(spec) if field.name not in unread]
    return (*parts, spec.readout.device, spec.readout.chip, spec.soldered_thermistor)


def board_inputs(stage: str, layout: Layout) -> tuple[object, ...]:
    """Return the inputs of a stage that makes printed parts or meshes.

    They are the spec without its tail, and the board up to `NEAR` from its body. If only the tail becomes longer, the
    mount is therefore not made again.
    """
    spec = replace(layout.spec, fpc=replace(layout.spec.fpc, tail=None, boards=None))
    limit = layout.body[2] + NEAR
    near = tuple(point for point in layout.outline.flattened(1e-6) if point.x < limit)
    plate = layout.stiffener
    if plate is not None and bounding_box((plate.outline.outline,))[0] > limit:
        plate = None
    return (*spec_inputs(stage, spec), layout.body, near, plate, layout.copper_layers, layout.spec.fpc.tail_layers)


def calibration_files(calibration: Calibration) -> dict[str, bytes]:
    """Return the files of a calibration by name.

    They are ``calibration.json``, ``calibration.h`` with the program ``example.c``, and ``calibration.html``. If the
    sensor reads its temperature, ``temperature.h`` is added. Before measurements, ``plan.csv`` and ``plan.txt`` are
    added, and ``plan.svg`` if loads act beside the middle.
    """
    remarks = [*_state(calibration), *(f"{note[0].upper()}{note[1:]}." for note in calibration.notes)]
    files = {
        "calibration.json": to_json({"sitscad": __version__, **calibration.document()}).encode("ascii"),
        "calibration.h": header(calibration.map, calibration.sensors.conversion, remarks, calibration.cell),
        "example.c": program(calibration.cell),
        "calibration.html": calibration_page(calibration),
    }
    if calibration.map.drifts is not None:
        files["temperature.h"] = compensation_header(
            calibration.map.drifts, [*_state(calibration), *(each for each in calibration.remarks if each == FORCED)],
            calibration.cell)
    if calibration.plan is not None:
        files |= {
            "plan.csv": plan_csv(calibration),
            "plan.txt": plan_instructions(calibration, calibration.plan),
        }
        if calibration.sensors.range.has_moments:
            files["plan.svg"] = plan_card(calibration, calibration.plan)
    return files


def nominal_calibration(design: Design, forced: bool = False) -> dict[str, bytes]:
    """Return the files of the folder ``calibration`` in a package: planned loads, and the map of the nominal sensor.

    The target is assumed to be kept level, as in the data sheet. Each cell has its own folder. If the package is
    ``forced`` (built in spite of errors), all files except table and program have a remark. Empty if the design senses
    no force.
    """
    if not is_felt(design.spec):
        return {}
    files, has_cells = dict[str, bytes](), design.spec.cells is not None
    for number, cell in enumerate(design.cells, 1):
        with suppress(NoResponse):
            result = plan_calibration(cell.response)
            if cell.spec.readout.compensation is not None:
                result = with_temperatures(result, cell.sensing.solved, design.layout.reference_name)
            result = replace(result, cell=number if has_cells else None, remarks=(FORCED,) * forced + result.remarks)
            folder = f"calibration/cell-{number}" if has_cells else "calibration"
            files |= {f"{folder}/{name}": content for name, content in calibration_files(result).items()}
    return files | {"calibration/readme.txt": CELLS_READ.encode("ascii")} if files and has_cells else files


CELLS_READ = """Every cell has a map of its own: cell-1, cell-2, ... in the order of the coils.

These are maps of the sensor as it is drawn. The driver in ../firmware takes all of them (cells.h) and gives the forces
of every cell; a cell-N/calibration.h in ../firmware itself goes before the one here.

Calibrate each cell N of your sensor in a copy of the package, in its folder firmware/, and build again:
  sitscad calibrate ../spec/*.yaml --cell N --from serial:PORT -o cell-N
By hand: fill in cell-N/plan.csv of this folder, and there
  sitscad calibrate ../spec/*.yaml cell-N/plan.csv --cell N -o ../firmware/cell-N
Newtons on a computer, with every cell-N/calibration.json that is in the folder firmware/:
  sitscad read serial:PORT --design .. --calibration .
"""


@checked_arguments
def write_calibration(calibration: Calibration, folder: str | Path) -> tuple[Path, ...]:
    """Write the files of a calibration into a folder and return their paths. Other files stay.

    Parameters
    ----------
    calibration
        The result of `calibrate`.
    folder
        Folder of the files. It is created if it is missing.

    Returns
    -------
    tuple of Path
        Paths of the written files.

    Raises
    ------
    PackageError
        if the folder or a file cannot be written
    """
    place = Path(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise PackageError(f"cannot make the folder {folder}: {error.strerror or error}") from error
    files = calibration_files(calibration)
    for name, content in files.items():
        write_file(place / name, content)
    return tuple(place / name for name in files)


def _state(calibration: Calibration) -> list[str]:
    """Return a line that states whether the sensor was measured, and whether the target could tilt under the loads."""
    tilts = ROTATIONS[calibration.sensors.rotation]
    if calibration.points is None:
        return [f"NOT calibrated: the map of the sensor as it is drawn, its target {tilts}. Calibrate every sensor."]
    return [f"Calibrated by {calibration.unit_errors[0].points} points, the target {tilts}; {calibration.map.form}."]
