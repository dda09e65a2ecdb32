"""A family with nothing of TI's: what is printed, judged and chosen for it is its own."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest

import sitscad
from sitscad.papers import firmware
from sitscad.readout import ldc_registers
from sitscad.readout.converter import Converter
from sitscad.readout.registers import REQUIRED, RegisterMap
from sitscad.spec import presets
from tests.bench.conftest import TEMPLATES
from tests.readout.family import xdc_registers


def design_with(device: Converter, **readout: object) -> sitscad.Design:
    """The bench's template with another converter."""
    spec = sitscad.load(TEMPLATES / "bench_7mm.yaml")
    return sitscad.Design(replace(spec, readout=replace(spec.readout, device=device, **readout)))


def test_the_header_has_words_of_its_own_registers_alone(xdc2214):
    design = design_with(xdc2214)
    header = firmware.render(design.spec, design.estimates)["firmware/xdc2214_config.h"].decode()
    assert "after power-up or reset; RUN comes last: it starts the scan." in header
    assert re.search(r"20 bits, all of them counts \(XAC0001 7.1\)\.\n \* Faults stand in the upper bits", header)
    assert not re.search("CONFIG comes|ERROR_CONFIG|watchdog|under-range|over-range", header)


def test_a_module_of_registers_has_every_name_that_is_asked_of_it(xdc2214, monkeypatch):
    found: RegisterMap = ldc_registers
    assert set(REQUIRED) == {"MANUFACTURER_ID", "DEVICE_ID", "STATUS", "MANUFACTURER", "DATA_FLAGS", "ORDER",
                             "data_addresses", "registers", "said_of_results"} <= set(vars(found))
    without = {name: value for name, value in vars(xdc_registers).items() if name not in ("STATUS", "registers")}
    monkeypatch.setitem(sys.modules, "sitscad.readout.xdc_registers", SimpleNamespace(**without))
    presets.converter.cache_clear()
    with pytest.raises(ValueError, match="xdc_registers lacks STATUS, registers, which RegisterMap"):
        presets.converter("xdc2214")
