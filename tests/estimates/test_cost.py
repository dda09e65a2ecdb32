"""What an estimate holds in memory at a time: it does not grow with the square of the turns."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from tolerance import approx

from sitscad.estimates import estimate
from sitscad.estimates.circuits import coils
from sitscad.estimates.circuits import solved_winding as solved
from sitscad.estimates.states.near import HEIGHTS
from sitscad.estimates.windings import leads
from sitscad.kernels.electromagnetics.metal import near_metal
from sitscad.layout import lay_out
from sitscad.spec.load import load_text

SPEC = """
sitscad: 1
name: cost
coil: {shape: racetrack, outer_diameter: [12, 8], turns: 12, layers: 4, trace_width: 0.1, trace_spacing: 0.1}
"""


@pytest.mark.slow
def test_estimate_of_many_turns_uses_less_than_25_megabytes():
    """The field along 48 turns with 2,700 chords was worked out for all places at once: 95 MB."""
    layout = lay_out(load_text(SPEC, "cost.yaml"))
    tracemalloc.start()
    estimate(layout)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 25e6


def test_only_long_path_sides_are_subdivided():
    """Every chord of an arc was cut into as many pieces as the longest straight side: twenty times as many points."""
    bend = np.array([(np.sin(a), 1.0 - np.cos(a)) for a in np.linspace(0.0, np.pi, 20)]) * 2e-3
    corners = np.concatenate([[(-20.1 * leads.LONGEST, 0.0)], bend])
    middle, elements = leads._sample_path(corners, 1e-4)
    assert len(middle) == len(elements) == 21 + 19
    assert elements.sum(axis=0) == approx(corners[-1] - corners[0], abs=1e-15)
    assert middle[:21, 0] - elements[:21, 0] / 2 == approx(corners[0, 0] + np.arange(21) * elements[0, 0], abs=1e-15)
    assert middle[21:, :2] == approx(0.5 * (bend[1:] + bend[:-1]), abs=1e-15) and np.all(middle[:, 2] == 1e-4)


def test_slightly_changed_target_and_pad_reuse_spectra_and_modes(monkeypatch):
    """A pad thinner by some per cent, or a thicker target, made all of them anew: seconds for every hint that is
    tried, and another few for the spread of the pad's thickness."""
    modes = []
    monkeypatch.setattr(near_metal, "_reduce_modes", counted(modes, near_metal._reduce_modes))
    for stored in (solved._spectrum, coils._led_out):
        stored.cache_clear()
    layout = lay_out(load_text(MOUNTED, "cost.yaml"))
    estimate(layout)
    before = sum(len(surroundings) for _, surroundings, *_ in modes)
    assert [stored.cache_info().misses for stored in (solved._spectrum, coils._led_out)] == [1, 2]
    spec = layout.spec
    target, elastomer = spec.target, spec.elastomer
    estimate(replace(layout, spec=replace(spec, target=replace(target, thickness=0.3e-3))))
    estimate(replace(layout, spec=replace(spec, elastomer=replace(elastomer, thickness=0.97e-3))))
    assert [stored.cache_info().misses for stored in (solved._spectrum, coils._led_out)] == [1, 2]
    assert sum(len(surroundings) for _, surroundings, *_ in modes) <= 1.5 * before


@pytest.mark.parametrize("thickness", [1.3, 1.9])
def test_states_and_solved_target_share_winding_spectrum(thickness):
    """The target is solved down to a rounded height. Its own waves would cost as much again."""
    solved._spectrum.cache_clear()
    estimate(lay_out(load_text(MOUNTED.replace("thickness: 1,", f"thickness: {thickness},"), "cost.yaml")))
    assert solved._spectrum.cache_info().misses == 1


def test_metal_at_several_target_heights_is_solved_in_shared_calls(monkeypatch):
    """Reading the modes and waves of a winding takes most of the time. Four heights read them four times as often."""
    calls = []
    monkeypatch.setattr(near_metal, "_reduce_modes", counted(calls, near_metal._reduce_modes))
    estimate(lay_out(load_text(MOUNTED, "cost.yaml")))
    assert len(calls) < sum(len(surroundings) for _, surroundings, *_ in calls)
    assert max(len(surroundings) for _, surroundings, *_ in calls) >= HEIGHTS


def counted(calls, function):
    def called(*arguments):
        calls.append(arguments)
        return function(*arguments)

    return called


MOUNTED = """
sitscad: 1
name: cost
coil: {shape: square, outer_diameter: 6, turns: 6, layers: 2, trace_width: 0.1, trace_spacing: 0.1}
array: {pattern: line, count: 2, pitch: 7}
target: {shape: rectangle, size: [13, 6], thickness: 0.2, material: copper}
elastomer: {shape: rectangle, size: [13, 6], thickness: 1, material: ecoflex-00-30}
requirements: {normal_force: 2 N}
fpc: {tail: {length: 20, connector: zif-0.5mm}}
"""
