"""The files of a calibration: what a bench needs, what firmware needs, what a person reads."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sitscad.calibration.calibration import Calibration, foretell
from sitscad.design import Design
from sitscad.drawing.frame import FORCED
from sitscad.estimates.response.pad import NoResponse
from sitscad.formats.calibration_header import header
from sitscad.formats.calibration_program import program
from sitscad.package.folder import PackageError, write_file
from sitscad.papers import calibration_plan
from sitscad.report.calibration import calibration_page
from sitscad.report.findings import to_json
from sitscad.scene.motions import ROTATIONS
from sitscad.version import __version__
from sitscad.writer import is_felt


def calibration_files(found: Calibration) -> dict[str, bytes]:
    """Every file of a calibration by its name: ``calibration.json``, ``calibration.h`` with the program ``example.c``,
    ``calibration.html``; before anything is measured also ``plan.csv`` and ``plan.txt``.
    """
    remarks = [*_state(found), *(f"{note[0].upper()}{note[1:]}." for note in found.notes)]
    files = {
        "calibration.json": to_json({"sitscad": __version__, **found.document()}).encode("ascii"),
        "calibration.h": header(found.map, found.sensors.conversion, remarks),
        "example.c": program(),
        "calibration.html": calibration_page(found),
    }
    if found.plan is not None:
        files |= {
            "plan.csv": calibration_plan.table(found, found.plan),
            "plan.txt": calibration_plan.words(found, found.plan),
        }
    return files


def drawn_calibration(design: Design, forced: bool = False) -> dict[str, bytes]:
    """The files of a package: the plan of a calibration, and the map of the sensor as it is drawn, in the folder
    ``calibration``, of a target that is kept level as in the data sheet; none where there is nothing to calibrate. All
    but the table to fill in and the program say so where the package is ``forced``.
    """
    if not is_felt(design.spec):
        return {}
    try:
        found = foretell(design.response)
    except NoResponse:
        return {}
    if forced:
        found = replace(found, remarks=(FORCED, *found.remarks))
    return {f"calibration/{name}": content for name, content in calibration_files(found).items()}


def write_calibration(found: Calibration, folder: str | Path) -> tuple[Path, ...]:
    """Write the files of a calibration into a folder, each as a whole, and give their paths; others are left as they
    are. Raises PackageError where that cannot be done.
    """
    place = Path(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise PackageError(f"cannot make the folder {folder}: {error.strerror or error}") from error
    files = calibration_files(found)
    for name, content in files.items():
        write_file(place / name, content)
    return tuple(place / name for name in files)


def _state(found: Calibration) -> list[str]:
    """Whether the sensor was measured, and how it was loaded."""
    tilts = ROTATIONS[found.sensors.rotation]
    if found.points is None:
        return [f"NOT calibrated: the map of the sensor as it is drawn, its target {tilts}. Calibrate every sensor."]
    return [f"Calibrated by {len(found.points)} points, the target {tilts}; {found.form.form.name}."]
