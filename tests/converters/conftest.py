"""Converters that nobody makes, added by their data alone."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from sitscad.data import FOLDER
from sitscad.kernels.converters import conversion, figures
from sitscad.kernels.converters.converter import Converter
from sitscad.kernels.converters.reference_counter import ReferenceCounter
from sitscad.spec import presets
from sitscad.spec.format.kinds import names
from tests.converters.family import xdc_registers

FAMILY = Path(__file__).parent / "family"
OWN_ROW = 'xdc2214,xdc221x,4,0x10 0x11 0x12 0x13,"QFN-24, 5 x 5 mm",verified,"X Corp XDC2214 data sheet, 3"\n'


def counter(
    device: Converter, rcount: int = 9471, divider: int = 1, gain: int = 0, offsets: tuple[int, ...] = (),
    reference: float = 40e6, settle_count: int = 8, channels: int = 4,
) -> ReferenceCounter:
    """Settings of a converter that counts a reference clock."""
    return ReferenceCounter(device, channels, reference, 1, divider, rcount, settle_count, gain, offsets)


def forget() -> None:
    """What was read of the tables."""
    cached = [read for room in (figures, conversion) for read in vars(room).values() if hasattr(read, "cache_clear")]
    for read in (presets._table, presets.converter, names, *cached):
        read.cache_clear()


@pytest.fixture
def data(monkeypatch, tmp_path) -> Iterator[Path]:
    """A copy of the tables of figures, which are read in their stead."""
    folder = tmp_path / "data"
    shutil.copytree(FOLDER, folder, ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    monkeypatch.setattr("sitscad.data.FOLDER", folder)
    forget()
    yield folder
    forget()


@pytest.fixture
def xdc2214(monkeypatch, data) -> Converter:
    """A converter unlike TI's: 20 bits, 16 drive codes, four addresses, 5 to 15 MHz, own registers, no driver."""
    shutil.copy(FAMILY / "xdc221x.csv", data / "converters")
    with (data / "converters.csv").open("a") as table:
        table.write(OWN_ROW)
    monkeypatch.setitem(sys.modules, "sitscad.kernels.converters.xdc_registers", xdc_registers)
    return presets.converter("xdc2214")
