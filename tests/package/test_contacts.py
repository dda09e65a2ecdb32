"""Every template with every terminal: 0.5 and 0.3 mm sockets and solder pads, through KiCad's checker and read back."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest

import sitscad

TEMPLATES = Path(__file__).parents[2] / "templates"
SHOWN = ("grasper_4layer",)
BUILT = [
    ("bench_7mm", "zif-0.3mm"),
    *(
        pytest.param(path.stem, terminal, marks=[pytest.mark.slow, *([] if path.stem in SHOWN else [pytest.mark.more])])
        for path in sorted(TEMPLATES.glob("*.yaml"))
        for terminal in ("zif-0.3mm", "solder-pads")
        if (path.stem, terminal) != ("bench_7mm", "zif-0.3mm") and path.stem != "single_coil"
    ),
]


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.clients("kicad-cli")
@pytest.mark.parametrize(("template", "terminal"), BUILT)
def test_template_with_other_connector_passes_kicad_and_verification(template, terminal, tmp_path):
    pytest.importorskip("gerbonara", reason="verify reads Gerbers through gerbonara, which sitscad[all] brings")
    text = (TEMPLATES / f"{template}.yaml").read_text(encoding="utf-8")
    text, changed = re.subn(r"connector: [\w.-]+", f"connector: {terminal}", text)
    assert changed == 1
    if terminal == "zif-0.3mm" and "layers: 4" in text and "layers: 2" not in text:
        text = text.replace("  tail:\n", "  tail:\n    layers: 2\n")  # four are thicker than that socket takes
    spec = sitscad.load_text(text, "other.yaml")
    layout = sitscad.lay_out(spec)
    assert layout.shortfalls == ()
    findings = [f for f in sitscad.check(spec, layout, hints="none").findings if f.rule.startswith("SIT1")]
    assert [f for f in findings if f.severity == "error"] == []
    sitscad.build(spec, tmp_path, only=("gerber", "kicad"), force=True)
    folder = tmp_path / spec.name
    assert sitscad.verify(folder).ok
    report = tmp_path / "drc.json"
    command = ["kicad-cli", "pcb", "drc", "--format", "json", "--severity-all", "--exit-code-violations"]
    done = subprocess.run(
        [*command, "-o", str(report), str(next(folder.glob("kicad/*.kicad_pcb")))], capture_output=True, check=False
    )
    assert done.returncode == 0, json.loads(report.read_text())
