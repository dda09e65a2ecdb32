"""Every template's finished flex files, read back: nets, loops, and the copper's resistance."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from probe_spots import touched
from tolerance import approx

pytest.importorskip("gerbonara", reason="gerbonara is not installed: pip install 'sitscad[all]' brings it")
pytest.importorskip("shapely", reason="shapely is not installed: pip install 'sitscad[all]' brings it")

from sitscad.estimates import estimate
from sitscad.files.extraction.differences import DifferenceKind, compare, extract
from sitscad.files.extraction.intent import UNUSED
from sitscad.files.formats import gerber, ipc356
from sitscad.layout import lay_out
from sitscad.layout.board import Layout
from sitscad.spec.load import load
from tests.oracles.copper_resistance import copper_resistance


@pytest.fixture(scope="module")
def finished(template, tmp_path_factory) -> tuple[Layout, Path]:
    """A template's layout, and the directory with its Gerber files, drill file and netlist."""
    layout = lay_out(load(template))
    folder = tmp_path_factory.mktemp(template.stem)
    for render in (gerber.render, gerber.render_drills, ipc356.render):
        for name, content in render(layout).items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
    return layout, folder


def test_template_files_read_back_without_difference(finished):
    _, folder = finished
    assert compare(extract(folder)) == ()


def test_each_extracted_coil_net_has_exactly_its_two_contacts(finished):
    layout, folder = finished
    board = extract(folder)
    assert len([net for net in board.nets if not _unused(net)]) == len(layout.coils)
    for coil in layout.coils:
        functions = [contact.function for contact in board.net(coil.net).contacts]
        assert sorted(functions) == [f"{coil.name}.A", f"{coil.name}.B"]


def _unused(net) -> bool:
    """Whether it is a contact of the connector that leads nowhere."""
    return all(name.startswith(UNUSED) for name in net.names)


def test_copper_grown_by_almost_half_spacing_has_no_short_or_loop(finished):
    """A loop or a short between grown tracks would be copper that stands closer than the spec's spacing."""
    layout, folder = finished
    spacing = min(layout.spec.coil.trace_spacing, layout.spec.fpc.rules.trace_spacing)
    board = extract(folder, growth=0.49 * spacing)
    assert sorted(net.names for net in board.nets if not _unused(net)) == [(coil.net,) for coil in layout.coils]
    assert all(not net.loops for net in board.nets)


def test_tracks_wide_enough_to_touch_are_reported_as_loops(finished, tmp_path):
    """The netlist of such a coil is still right: only the loops give it away."""
    layout, folder = finished
    spec = layout.spec.coil
    wider = 1.05 * (spec.trace_width + spec.trace_spacing)
    result = 0
    for path in sorted((folder / "fpc").iterdir()):
        text = path.read_text(encoding="utf-8")
        for aperture, diameter in re.findall(r"(%ADD\d+C,)([0-9.]+)\*%", text):
            if float(diameter) * 1e-3 == approx(spec.trace_width, rel=1e-6):
                text = text.replace(f"{aperture}{diameter}*%", f"{aperture}{wider * 1e3:.6f}*%")
                result += 1
        (tmp_path / path.name).write_text(text, encoding="utf-8")
    assert result
    kinds = [difference.kind for difference in compare(extract(tmp_path))]
    assert kinds.count(DifferenceKind.LOOP) >= len(layout.coils)


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.needs("gmsh", "scipy")
def test_resistance_of_extracted_copper_matches_estimate(finished):
    layout, folder = finished
    board = extract(folder)
    copper = layout.spec.fpc.stackup.copper
    estimates = {coil.name: coil for coil in estimate(layout).coils}
    for coil in layout.coils:
        net = board.net(coil.net)
        start, end = (touched(contact) for contact in sorted(net.contacts, key=lambda contact: contact.function))
        result = copper_resistance(
            net,
            start,
            end,
            [layer.thickness for layer in copper],
            depths=[layer.z for layer in copper],
            plating=layout.spec.fpc.stackup.plating_thickness or None,
            fineness=1.0,
        )
        assert result == approx(estimates[coil.name].terminal_resistance_dc, rel=0.008, abs=0)
