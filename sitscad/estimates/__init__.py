"""Electrical estimates of a layout, computed by the physics kernels from the drawn geometry."""

from __future__ import annotations

from dataclasses import replace

from sitscad.basics.arguments import checked_arguments
from sitscad.estimates.coil_estimates import CoilEstimate, CrossCheck, Estimates, ReadoutEstimate, StateEstimate
from sitscad.estimates.states.steps import coil_estimates, solve_windings, tune_circuits
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
    """Estimate all electrical values of a layout, for the bare coils and for the mounted sensor.

    Identical coils are solved once.

    Parameters
    ----------
    layout
        A layout, with or without leads. If it has none, contact values are the winding's, and a note records
        this.
    method
        Name of a row in METHODS, used for the winding's inductance. If None, it is the cheapest method whose
        stated error
        meets `tolerance`.
    tolerance
        Largest relative error of the inductance; 1e-4 if None. The resistance has a stated error of its own.
        Below 3e-3 the
        resistance is solved more finely.
    temperature
        Temperature (degrees Celsius) at which the conductivities of all tracks, barrels and metals are taken.
        If None, it is
        the spec's temperature.

    Returns
    -------
    Estimates
        Values of every coil, free, at rest and pressed, and the settings of the readout.

    Raises
    ------
    ValueError
        If the method does not exist or does not serve the shape, or if the tolerance is not above 0.
    SpecError
        If the spec was built in Python and has values that no spec file can have.

    Examples
    --------
    >>> import sitscad
    >>> coil = {"shape": "circle", "outer_diameter": 8, "turns": 14, "layers": 2,
    ...         "trace_width": "100 um", "trace_spacing": "100 um"}
    >>> spec = sitscad.SensorSpec.from_mapping(name="bench", coil=coil)
    >>> estimates = sitscad.estimate(sitscad.lay_out(spec))
    >>> round(1e6 * estimates.coils[0].winding_inductance, 1)
    3.9
    """
    if tolerance is not None and not tolerance > 0.0:
        raise ValueError(f"a tolerance is a number above 0, not {tolerance}")
    refuse_unusable(layout.spec)
    estimates = estimate_layout(layout, method, tolerance, temperature)
    missed = () if tolerance is None else missed_tolerance(estimates.coils, tolerance, method)
    return replace(estimates, notes=(*missed, *estimates.notes))


def missed_tolerance(coils: tuple[CoilEstimate, ...], tolerance: float, method: str | None) -> tuple[str, ...]:
    """Return a note if the largest inductance error of all coils exceeds `tolerance`. Empty if it does not."""
    worst = max(coils, key=lambda coil: coil.inductance_error)
    if worst.inductance_error <= tolerance:
        return ()
    start = f"the method {method} does not meet" if method else "no method meets"
    return (f"{start} a tolerance of {tolerance:g} for this coil: {worst.method} states {worst.inductance_error:.2g}",)


@one_thread
def estimate_layout(
    layout: Layout, method: str | None = None, tolerance: float | None = None, temperature: float | None = None,
    is_solved: bool | None = None,
) -> Estimates:
    """Return the estimates of a layout without validation of its spec or arguments, which are as in `estimate`.

    `is_solved` selects how the target's effect is computed: by the field solution (True), or as an infinite plate's
    effect, multiplied by correction ratios (False). If None, the field solution is used for targets that are small
    enough to be solved in about a second.
    """
    tuned = tune_circuits(solve_windings(layout.sensing, temperature, method, tolerance), is_solved)
    alone = layout.reference_alone
    if alone is None:
        return coil_estimates(tuned)
    # all coils share one value of the capacitor, which the sensing coils determine
    readout = replace(alone.spec.readout, capacitance=tuned.tank.capacitor)
    alone = replace(alone, spec=replace(alone.spec, readout=readout))
    return coil_estimates(tuned, tune_circuits(solve_windings(alone, temperature, method, tolerance)))
