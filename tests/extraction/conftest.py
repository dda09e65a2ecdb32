"""Small boards written by hand, as a fabricator would get them; nothing here knows sitscad's writers."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import pytest

HEADER = """%TF.GenerationSoftware,by,hand*%
%TF.SameCoordinates,board*%
%TF.FileFunction,{function}*%
%TF.FilePolarity,{polarity}*%
%FSLAX46Y46*%
%MOMM*%
%TA.AperFunction,Conductor*%
%ADD10C,0.100000*%
%TD*%
%TA.AperFunction,ConnectorPad*%
%ADD11R,0.600000X0.400000*%
%TD*%
%TA.AperFunction,ViaPad*%
%ADD12C,0.300000*%
%TD*%
%ADD13C,0.500000*%
G75*
G01*
%LPD*%
"""


def count(millimetres: float) -> int:
    return round(millimetres * 1e6)


def track(net: str, *points: tuple[float, float], aperture: int = 10) -> str:
    (x, y), *rest = points
    lines = [f"%TO.N,{net}*%", f"D{aperture}*", "G01*", f"X{count(x)}Y{count(y)}D02*"]
    lines += [f"X{count(x)}Y{count(y)}D01*" for x, y in rest]
    return "\n".join([*lines, "%TD*%\n"])


def pad(net: str, pin: str, x: float, y: float, function: str = "") -> str:
    reference, number = pin.split("-")
    attribute = f"%TO.P,{reference},{number}" + (f",{function}*%" if function else "*%")
    return f"%TO.N,{net}*%\n{attribute}\nD11*\nX{count(x)}Y{count(y)}D03*\n%TD*%\n"


def via(net: str, x: float, y: float) -> str:
    return f"%TO.N,{net}*%\nD12*\nX{count(x)}Y{count(y)}D03*\n%TD*%\n"


@dataclass
class Board:
    """A board under way: what each copper layer draws, where the holes are, the netlist's records."""

    layers: list[str]
    holes: list[tuple[float, float]] = field(default_factory=list)
    hole_diameter: float = 0.15
    plating: str = "Plated"
    openings: dict[str, str] = field(default_factory=dict)
    netlist: str | None = None

    def write(self, folder: Path) -> Path:
        names = [f"L{i},{self._side(i)}" for i in range(1, len(self.layers) + 1)]
        for name, body in zip(names, self.layers, strict=True):
            text = HEADER.format(function=f"Copper,{name}", polarity="Positive") + body + "M02*\n"
            (folder / f"copper-{name[:2]}.gbr").write_text(text)
        for side, body in self.openings.items():
            text = HEADER.format(function=f"Soldermask,{side}", polarity="Negative") + body + "M02*\n"
            (folder / f"mask-{side}.gbr").write_text(text)
        (folder / "holes.drl").write_text(self._drill())
        if self.netlist is not None:
            (folder / "board.ipc").write_text(self.netlist)
        return folder

    def _side(self, layer: int) -> str:
        return "Top" if layer == 1 else "Bot" if layer == len(self.layers) else "Inr"

    def _drill(self) -> str:
        span = f"1,{len(self.layers)}," + ("PTH" if self.plating == "Plated" else "NPTH")
        head = f"M48\n; #@! TF.FileFunction,{self.plating},{span}\nFMAT,2\nMETRIC\nT1C{self.hole_diameter}\n%\n"
        return head + "G90\nG05\nT1\n" + "".join(f"X{x:.4f}Y{y:.4f}\n" for x, y in self.holes) + "M30\n"


@pytest.fixture
def two_nets() -> Board:
    """Two layers. C1 goes from a pad through two vias to another pad, C2 is a plain track above it (y 3 mm)."""
    top = pad("C1", "J1-1", 0, 0, "C1.A") + track("C1", (0, 0), (5, 0)) + via("C1", 5, 0) + via("C1", 5, 2)
    top += track("C1", (5, 2), (0, 2)) + pad("C1", "J1-2", 0, 2, "C1.B")
    top += pad("C2", "J1-3", 0, 3) + track("C2", (0, 3), (5, 3)) + pad("C2", "J1-4", 5, 3)
    bottom = via("C1", 5, 0) + via("C1", 5, 2) + track("C1", (5, 0), (5, 2))
    return Board([top, bottom], [(5, 0), (5, 2)], netlist=NETLIST)


def record(code: str, net: str, pin: str, access: str, x: float, y: float) -> str:
    """A test record of IPC-D-356A in units of 0.001 mm, by its columns."""
    reference, number = pin.split("-") if "-" in pin else (pin, "")
    hole = "D0150P" if code == "317" else " " * 6
    dash = "-" if number else " "
    where = f"X{round(x * 1000):+07d}Y{round(y * 1000):+07d}"
    return f"{code}{net:<14}   {reference:<6}{dash}{number:<4} {hole}A{access}{where}X0600Y0400R000 S0\n"


NETLIST = (
    "C  written by hand\nP  UNITS CUST 1\n"
    + record("327", "C1", "J1-1", "01", 0, 0)
    + record("327", "C1", "J1-2", "01", 0, 2)
    + record("317", "C1", "VIA", "00", 5, 0)
    + record("317", "C1", "VIA", "00", 5, 2)
    + record("327", "C2", "J1-3", "01", 0, 3)
    + record("327", "C2", "J1-4", "01", 5, 3)
    + "999\n"
)
