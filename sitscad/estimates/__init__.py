"""From a layout to its electrical numbers: the one meeting point of what is drawn and of physics."""

from __future__ import annotations

from dataclasses import replace

from sitscad.basics.arguments import checked_arguments
from sitscad.estimates.coil_estimates import CoilEstimate, CrossCheck, Estimates, ReadoutEstimate, StateEstimate
from sitscad.estimates.states.steps import read, wind, with_target
from sitscad.estimates.windings.methods import METHODS, Method
from sitscad.kernels.electromagnetics.threads import one_thread
from sitscad.layout.board import Layout
from sitscad.spec.resolver.validity import refuse_unusable

__all__ = [
    "METHODS", "CoilEstimate", "CrossCheck", "Estimates", "Method", "ReadoutEstimate", "StateEstimate", "estimate"
]


@checked_arguments
def estimate(
    layout: Layout, method: str | None = None, tolerance: float | None = None, temperature: float | None = None
) -> Estimates:
    """Everything electrical about a layout, free and mounted.

    `method` names a row of METHODS for the winding's inductance; otherwise the cheapest one is taken whose stated error
    meets `tolerance` (relative; 1e-4 when None). Alike coils are solved once. Works without leads too, where the layout
    found no room for them: the contacts then see the winding alone, and a note says so. Raises ValueError for a method
    that does not exist or does not serve the shape, and for a tolerance that is not above 0. R states its own error; it
    is solved finer for a tolerance below 3e-3. `temperature` (degrees Celsius; the spec's where None) sets the
    conductivity of every track, barrel and metal. Raises SpecError where the layout's spec was put together in Python
    and has values that no text could have.
    """
    if tolerance is not None and not tolerance > 0.0:
        raise ValueError(f"a tolerance is a number above 0, not {tolerance}")
    refuse_unusable(layout.spec)
    found = estimated(layout, method, tolerance, temperature)
    missed = () if tolerance is None else missed_tolerance(found.coils, tolerance, method)
    return replace(found, notes=(*missed, *found.notes))


def missed_tolerance(coils: tuple[CoilEstimate, ...], tolerance: float, method: str | None) -> tuple[str, ...]:
    """The note that a tolerance of the inductance is not met. Empty if it is."""
    worst = max(coils, key=lambda coil: coil.inductance_error)
    if worst.inductance_error <= tolerance:
        return ()
    asked = f"the method {method} does not meet" if method else "no method meets"
    return (f"{asked} a tolerance of {tolerance:g} for this coil: {worst.method} states {worst.inductance_error:.2g}",)


@one_thread
def estimated(
    layout: Layout, method: str | None = None, tolerance: float | None = None, temperature: float | None = None,
    is_solved: bool | None = None,
) -> Estimates:
    """Estimates of a layout whose spec is known to be right, or is one that is tried.

    `is_solved` says whether the target is solved, for estimates that are compared. If it is left out, the target's size
    decides.
    """
    return read(with_target(wind(layout, temperature, method, tolerance), is_solved))
