"""What outside programs make of files."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest


@pytest.fixture
def sliced(tmp_path):
    """The G-code that PrusaSlicer makes of a mesh file in layers of 0.1 mm."""

    def slice_it(name: str, data: bytes) -> str:
        path, out = tmp_path / Path(name).name, tmp_path / "out.gcode"
        path.write_bytes(data)
        layers = ["--layer-height", "0.1", "--first-layer-height", "0.1", "--nozzle-diameter", "0.2"]
        subprocess.run(
            ["prusa-slicer", "--export-gcode", *layers, "-o", str(out), str(path)], check=True, capture_output=True
        )
        text = out.read_text()
        out.unlink()
        return text

    return slice_it
