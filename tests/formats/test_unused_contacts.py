"""Contacts that no coil has: copper without a net in every file, and one that touches a coil is found."""

from __future__ import annotations

import re

import pytest
from kicad_oracle import needs_kicad, rule_check, write
from layouts import order_set

import sitscad
from sitscad.files.extraction.differences import compare, extract
from sitscad.files.formats.kicad import project_files as kicad


@pytest.fixture(scope="module", params=["zif-0.3mm", "zif-0.5mm"])
def single(request):
    return sitscad.lay_out(
        sitscad.load_text(
            "sitscad: 1\nname: one\n"
            "coil: {shape: square, outer_diameter: 5, turns: 5, layers: 2, trace_width: 0.1, trace_spacing: 0.1}\n"
            f"fpc: {{tail: {{length: 30, connector: {request.param}}}}}\n",
            "one.yaml",
        )
    )


def unused(layout) -> list[int]:
    return [pad.number for pad in layout.pads if pad.is_unused]


def written(layout, folder):
    for path, content in order_set(layout).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
    return folder


def test_order_documents_list_unused_contacts(single):
    files = order_set(single)
    copper = files["fpc/one-F_Cu.gbr"].decode()
    for number in unused(single):
        assert f"%TO.P,J1,{number}*%" in copper
    assert "%TO.N,N/C*%" in copper
    records = [line for line in files["fpc/one-netlist.d356"].decode().splitlines() if line.startswith("327N/C ")]
    assert [int(line[27:31]) for line in records] == unused(single)
    words = " ".join(files["fpc/readme.txt"].decode().split())
    assert f"contacts {', '.join(map(str, unused(single)))} lead nowhere" in words
    assert f"{unused(single)[0]} unused - - - - -" in words
    width = single.spec.fpc.tail.connector.width(len(single.pads)) * 1e3
    assert re.search(rf"tail {width:g} mm \+/- (70|50) um wide there", words)


def test_unused_contacts_are_separate_nets_after_readback(single, tmp_path):
    folder = written(single, tmp_path)
    board = extract(folder)
    assert compare(board) == ()
    alone = [net for net in board.nets if net.names[0].startswith("N/C ")]
    assert len(alone) == len(unused(single))
    assert {net.names for net in alone} == {(f"N/C J1-{number}",) for number in unused(single)}


def test_readback_finds_unused_contact_joined_to_coil(single, tmp_path):
    folder = written(single, tmp_path)
    path = folder / "fpc/one-F_Cu.gbr"
    first = next(a for a, b in zip(single.pads, single.pads[1:], strict=False) if a.is_unused and not b.is_unused)
    other = single.pads[first.number]
    x, y = round(first.centre.x * 1e9), round((first.centre.y + other.centre.y) * 5e8)
    path.write_text(path.read_text().replace("M02*", f"%ADD90C,0.4*%\nD90*\nX{x}Y{y}D03*\nM02*"))
    messages = [difference.message for difference in compare(extract(folder))]
    assert any(f"N/C J1-{first.number}" in message and "are joined" in message for message in messages)


@needs_kicad
def test_rule_check_with_unused_contacts_finds_no_violation(single, tmp_path):
    files = kicad.render(single)
    text = files["kicad/one.kicad_pcb"].decode()
    assert all(f'(pad "{number}" connect rect' in text for number in unused(single))
    assert rule_check(write(files, tmp_path)) == ([], [])
