"""Relations between whole specs: what stays, scales or vanishes when a sensor is written or placed otherwise."""

from __future__ import annotations

import json
from typing import Any

import pytest
from tolerance import approx

import sitscad
from sitscad.estimates import Estimates

WINDING = {"shape": "circle", "outer_diameter": 7, "turns": 8, "layers": 2, "trace_width": 0.15, "trace_spacing": 0.15}
STACKUP = [
    {"coverlay": 0.0275},
    {"copper": 0.035},
    {"dielectric": 0.05, "material": "polyimide"},
    {"copper": 0.035},
    {"coverlay": 0.0275},
]


def estimated(coil: dict[str, Any] | None = None, **sections: Any) -> Estimates:
    """The estimate of a small sensor; JSON is YAML."""
    document = {"sitscad": 1, "name": "relation", "coil": WINDING | (coil or {}), **sections}
    return sitscad.estimate(sitscad.lay_out(sitscad.load_text(json.dumps(document), "relation.yaml")))


def numbers(found: Estimates, coil: int = 0) -> list[float]:
    """What is printed of a coil: winding, tank, every state."""
    item = found.coils[coil]
    values = [item.winding_inductance, item.resistance_dc, item.terminal_inductance, item.sensor_frequency]
    for state in item.states.values():
        values += [state.inductance, state.resistance, state.parallel_resistance, state.amplitude]
    return values


def test_estimates_do_not_depend_on_units_in_spec() -> None:
    written = estimated({"outer_diameter": "7000 um", "trace_width": "150 um", "trace_spacing": "0.015 cm"})
    assert numbers(written) == approx(numbers(estimated()), rel=1e-12)


@pytest.mark.parametrize("turned", ["360 deg", "-360 deg"])
def test_start_angle_plus_360_degrees_gives_equal_estimates(turned: str) -> None:
    assert numbers(estimated({"start_angle": turned})) == approx(numbers(estimated()), rel=1e-8)


def test_sense_and_start_do_not_change_the_winding() -> None:
    plain = estimated().coils[0]
    for change in ({"sense": "clockwise"}, {"start_angle": "33 deg"}, {"start_angle": "180 deg"}):
        other = estimated(change).coils[0]
        assert other.winding_inductance == approx(plain.winding_inductance, rel=1e-12)
        assert other.resistance_dc == approx(plain.resistance_dc, rel=1e-9)


def test_estimates_do_not_depend_on_coil_order_and_position() -> None:
    def pair(*centres: tuple[float, float]) -> Estimates:
        return estimated(array={"pattern": "explicit", "centres": centres})

    plain = pair((-4.5, 0), (4.5, 0))
    swapped, moved = pair((4.5, 0), (-4.5, 0)), pair((5.5, 3), (14.5, 3))
    assert numbers(swapped, 1) == approx(numbers(plain, 0), rel=1e-12)
    assert numbers(moved) == approx(numbers(plain), rel=1e-9)


def test_square_target_equals_rectangle_of_equal_sides() -> None:
    def with_target(shape: str, size: Any) -> Estimates:
        return estimated(
            target={"shape": shape, "size": size}, elastomer={"shape": shape, "size": size, "thickness": 1}
        )

    assert numbers(with_target("rectangle", [8, 8])) == approx(numbers(with_target("square", 8)), rel=1e-12)
    upright, lying = with_target("rectangle", [6, 9]), with_target("rectangle", [9, 6])
    assert numbers(upright) == approx(numbers(lying), rel=1e-4)  # the turns of a spiral differ along x and y


@pytest.mark.parametrize("scale", [0.5, 2.0])
@pytest.mark.parametrize("shape", ["circle", "square", "octagon"])
def test_direct_current_estimates_scale_with_length(shape: str, scale: float) -> None:
    def of(factor: float) -> list[float]:
        stackup = [{k: v * factor if isinstance(v, float) else v for k, v in layer.items()} for layer in STACKUP]
        sizes = {name: WINDING[name] * factor for name in ("outer_diameter", "trace_width", "trace_spacing")}  # type: ignore[operator]
        item = estimated(sizes | {"shape": shape}, fpc={"stackup": stackup}, readout={"capacitance": "330 pF"}).coils[0]
        assert item.winding_capacitance is not None
        return [item.winding_inductance / factor, item.resistance_dc * factor, item.winding_capacitance / factor]

    assert of(scale) == approx(of(1.0), rel=2e-7)


def test_distant_or_insulating_target_gives_estimates_without_target() -> None:
    def at_rest(**target: Any) -> list[float]:
        """Inductance, resistance and frequency at rest over those of the coil alone."""
        pad = {"size": 8, "thickness": target.pop("gap", 2)}
        result = estimated(target={"size": 8, **target}, elastomer=pad, readout={"capacitance": "220 pF"})
        rest, free = (result.coils[0].states[name] for name in ("rest", "free"))
        return [getattr(rest, name) / getattr(free, name) for name in ("inductance", "resistance", "frequency")]

    assert at_rest(gap=90) == approx([1.0] * 3, rel=1e-5)
    assert at_rest(material={"conductivity": "0 S/m"}) == approx([1.0] * 3, rel=1e-7)
    assert at_rest()[0] < 0.99


@pytest.mark.parametrize("shape", ["racetrack", "rectangle"])
def test_rotated_array_has_equal_coil_coupling(shape: str) -> None:
    coil = {"shape": shape, "outer_diameter": [8, 4], "turns": 5, "trace_width": 0.1, "trace_spacing": 0.1}

    def pair(centres: list[list[float]], rotations: list[str]) -> Estimates:
        return estimated(coil, array={"pattern": "explicit", "centres": centres, "rotations": rotations})

    plain = pair([[-5.0, 0.0], [4.0, 0.5]], ["0 deg", "90 deg"])
    turned = pair([[0.0, -5.0], [-0.5, 4.0]], ["90 deg", "180 deg"])
    matrix, other = plain.inductance_matrix, turned.inductance_matrix
    assert abs(matrix[0][1]) > 1e-3 * matrix[0][0]
    assert other[0][1] == approx(matrix[0][1], rel=1e-6) and other[0][0] == approx(matrix[0][0], rel=1e-9)
