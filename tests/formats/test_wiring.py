"""The schematic of the readout: KiCad finds nothing wrong with it, and its nets are those of contacts and pins."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

import sitscad
from sitscad.files.formats.kicad import schematic
from sitscad.layout.tail.tracks import contacts
from sitscad.spec import presets

TEMPLATES = Path(__file__).parents[2] / "templates"


def _design(name, converter):
    spec = sitscad.load(TEMPLATES / f"{name}.yaml")
    return sitscad.Design(replace(spec, readout=replace(spec.readout, device=presets.converter(converter))))


@pytest.mark.slow
@pytest.mark.clients("kicad-cli")
@pytest.mark.parametrize(("name", "converter"), [("three_axis_pad", "ldc1614"), ("three_axis_triangle", "ldc1612")])
def test_kicad_checks_schematic_without_error_and_reads_expected_nets(name, converter, tmp_path):
    """One converter, and two of two channels of which one is left over."""
    design = _design(name, converter)
    for path, content in schematic.render(design.layout, design.estimates).items():
        (tmp_path / Path(path).name).write_bytes(content)
    ask = ["kicad-cli", "sch"]
    checked = ["erc", "--severity-all", "--exit-code-violations", "-o", "erc.txt", "wiring.kicad_sch"]
    done = subprocess.run([*ask, *checked], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, (tmp_path / "erc.txt").read_text()
    subprocess.run(
        [*ask, "export", "netlist", "-o", "nets.net", "wiring.kicad_sch"], cwd=tmp_path, check=True, timeout=120
    )
    nets = {}
    for result in re.finditer(
        r'\(net \(code "\d+"\) \(name "/?([^"]+)"\)(.*?)(?=\(net \(code|\Z)', (tmp_path / "nets.net").read_text(), re.S
    ):
        nets[result[1]] = set(re.findall(r'\(ref "(\w+)"\)\s*\(pin "(\d+)"', result[2]))
    whole = (tmp_path / "nets.net").read_text()
    given = dict(re.findall(r'\(comp \(ref "(\w+)"\)\s*\(value "[^"]*"\)\s*\(footprint "([^"]+)"\)', whole))
    refs = set(re.findall(r'\(comp \(ref "(\w+)"\)', whole))
    assert refs == set(given) and given["Y1"].startswith("Oscillator:")
    count = len(design.layout.pads)
    assert given["J1"] == f"Connector_FFC-FPC:Amphenol-FCI_SFV{count}R-1ST_1x{count:02}-1MP_P0.5mm_Horizontal"
    # the tail goes in upwards and face down, pad 1 at the left: there its y is the lowest
    order = [pad.number for pad in sorted(design.layout.pads, key=lambda pad: pad.centre.y)]
    assert f"PinHeader_1x{5 + design.spec.readout.device.converter_count(len(design.layout.coils)):02}_" in given["J2"]
    assert ("WQFN-16" if converter == "ldc1614" else "WSON-12") in given["U1"]
    pins = {f"IN{channel}{end}": str(9 + 2 * channel + k) for channel in range(4) for k, end in enumerate("AB")}
    for item in contacts(design.layout):
        if item.net != "-":
            converter_number = item.converter.split()[0]
            pad = str(order.index(item.number) + 1)
            assert {("J1", pad), (f"U{converter_number}", pins[item.converter_pin])} < nets[item.pin]
            assert len(nets[item.pin]) == 3  # and the tank's capacitor
    for number in range(design.spec.readout.device.converter_count(len(design.layout.coils))):
        ref = f"U{number + 1}"
        assert {(ref, "1")} < nets["SCL"] and {(ref, "2")} < nets["SDA"] and {(ref, "6")} < nets["SD"]
        assert (ref, "4") in nets["VDD" if number else "GND"] and {(ref, "3"), ("Y1", "3")} <= nets["CLK"]


@pytest.mark.slow
def test_wiring_picture_labels_every_net():
    design = _design("three_axis_pad", "ldc1614")
    picture = schematic.render(design.layout, design.estimates)["firmware/wiring/wiring.svg"].decode()
    assert all(f">{word}<" in picture for word in ("SD", "INTB1", "ADDR", "CLKIN", "C1.A", "IN3B", "GND"))
