"""SIT407 to SIT409: notes on what a reading can mean at all; the first two where the spec asks how finely it feels."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from sitscad.checks.cases import Case
from sitscad.checks.feeling.felt import NOISE_STEPS_SOURCE, POINTS, less_travel, where_felt, where_held, worst
from sitscad.checks.rules import Rule, Verdict
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.units import show

if TYPE_CHECKING:
    from sitscad.estimates.performance.quick import QuickPerformance

BESIDE_NOISE = 10.0
"""How many times the resolution one degree of tilt may be read as before it is worth a note."""


@where_felt
@where_held
def two_loads_one_reading(found: QuickPerformance, design: Design) -> Iterator[Verdict]:
    """Whether two loads within what is required read alike."""
    twins = design.twins
    if twins is not None:
        words = [" and ".join(f"{show(load[k], 'N', 3)} of {name.replace('_', ' along ')}"
                              for k, name in enumerate(("normal", "shear_x", "shear_y")) if name in found.bench.names)
                 for load in twins]
        yield AMBIGUOUS.found("target.size", advice=less_travel(design.spec), one=words[0], other=words[1])


@where_felt
def tilt_beside_noise(found: QuickPerformance, design: Design) -> Iterator[Verdict]:
    """One degree of tilt against the noise."""
    from sitscad.estimates.performance.tilts import DEGREE

    def over_noise(point: int, axis: int) -> float:
        here = found.points[point]
        return float(here.tilt_errors(DEGREE)[axis].max() / here.noise[axis])

    most = worst(found, found.bench.names, over_noise)
    if most is not None and most.value > BESIDE_NOISE:
        point = found.points[POINTS.index(most.at)]
        k = [name.replace("_", " along ") for name in found.bench.names].index(most.axis)
        yield TILT_COVERS.found("elastomer.thickness", most.value, BESIDE_NOISE, None, axis=most.axis, at=most.at,
                                force=float(point.tilt_errors(DEGREE)[k].max()), noise=float(point.noise[k]))


def unseen_shear(design: Design) -> Iterator[Verdict]:
    """Shear that is to be borne and that a coil alone reads as normal force."""
    if len(design.spec.array.placements) == 1:
        yield UNSEEN.found("requirements.shear_force", force=design.spec.requirements.shear_force or 0.0)


AMBIGUOUS = Case("two loads within what is required read alike: {one}, and {other}; no map tells them apart",)
TILT_COVERS = Case(
    "one degree of tilt is read as {force:N,2} of {axis} ({at}), {measured:.0f} times the noise of {noise:N,2}: the "
    "contact's tilt, not the noise, says how fine it is",
    hint="a face that keeps the target level (rotation=held), a calibration with the tilts of use, or "
         "requirements.tilt with tilt_error, so that it is judged",
)
UNSEEN = Case(
    "one coil alone sees no shear: {force:N} of it are borne, and what they do to the target is read as normal force",
    hint="two coils in line tell shear along them, three or four both axes",
)

MAP_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT407", "ambiguous-map", Severity.NOTE,
        "No two loads within the required ones, a tenth of full scale apart or more, give one reading.",
        "Where they do, the map from readings to forces cannot be inverted: no calibration helps.",
        "Less travel (a stiffer pad), a target whose edges stay over the coils, or another coil.", NOISE_STEPS_SOURCE,
        ("target", "elastomer", "feeling"), two_loads_one_reading,
    ),
    Rule(
        "SIT408", "tilt-beside-noise", Severity.NOTE,
        f"One degree of tilt is read as at most {BESIDE_NOISE:.0f} times the noise of every axis.",
        "A resolution that tilt covers is none in use.",
        "Keep the face level, or calibrate with the tilts of use; state tilt and tilt_error.", NOISE_STEPS_SOURCE,
        ("target", "elastomer", "feeling"), tilt_beside_noise,
    ),
    Rule("SIT409", "unseen-shear", Severity.NOTE, "A sensor that has to bear shear has coils that can see it.",
         "A coil alone reads how near the target is and how much of it lies over the coil, and cannot tell them apart.",
         "Two coils in line, or three or four.", "one reading, two unknowns (derived)",
         ("target", "elastomer", "shear force"), unseen_shear),
)
