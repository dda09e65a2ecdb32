"""The tongue under the tail and the cheeks beside it: they stand where the tail is not, its taper included."""

from __future__ import annotations

import pytest
from tolerance import approx

import sitscad
from sitscad.assembly.places.seating import tail_support

shapely = pytest.importorskip("shapely")

JAW = """
sitscad: 1
name: wide
coil: {{shape: circle, outer_diameter: {diameter}, turns: 4, layers: 2, trace_width: 150 um, trace_spacing: 150 um}}
array: {{pattern: line, count: 2, pitch: {pitch}}}
fpc: {{margin: [{margin}, 0], tail: {{length: 60, connector: {connector}}}}}
mount: {{kind: grasper-pad, jaw: robotic-12mm, standoff: 1.5}}
"""


@pytest.mark.parametrize("connector", ["zif-0.5mm", "solder-pads"])
@pytest.mark.parametrize(("diameter", "pitch", "margin"), [(8, 8.5, 0), (8, 8.5, 0.5), (7, 7.6, 0.2), (5, 6, 0)])
def test_cheeks_stand_beside_tail_over_full_length(diameter, pitch, margin, connector):
    """A body of 8.9 mm narrows to its tail of 2.5 mm over 3 mm: cheeks as for the tail's end stood in the taper."""
    spec = sitscad.load_text(JAW.format(diameter=diameter, pitch=pitch, margin=margin, connector=connector), "jaw.yaml")
    layout = sitscad.lay_out(spec)
    result = tail_support(layout)
    if result is None or result.cheeks is None:
        return
    board = shapely.Polygon([(p.x, p.y) for p in layout.outline.flattened(1e-6)])
    for inner, outer in ((result.tail[1], result.across[1]), (result.tail[0], result.across[0])):
        low, high = sorted((inner, outer))
        cheek = shapely.box(result.cheeks, low, result.along[1], high)
        assert board.intersection(cheek).area < 1e-10


def test_long_taper_has_no_cheeks():
    text = JAW.format(diameter=8, pitch=8.5, margin=0, connector="zif-0.5mm")
    layout = sitscad.lay_out(sitscad.load_text(text, "jaw.yaml"))
    result = tail_support(layout)
    assert result is not None and result.cheeks is None
    assert result.along == approx((layout.body[2], layout.spec.jaw.length / 2 - 0.2e-3), rel=1e-6)


def test_short_taper_leaves_room_for_cheeks():
    text = JAW.format(diameter=5, pitch=6, margin=0, connector="zif-0.5mm")
    result = tail_support(sitscad.lay_out(sitscad.load_text(text, "jaw.yaml")))
    assert result is not None and result.cheeks is not None
