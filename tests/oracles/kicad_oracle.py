"""KiCad's command line as a judge of what we write: its rule check, and its own Gerber and drill files."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

needs_kicad = pytest.mark.clients("kicad-cli")
"""Marks a test that asks KiCad."""


def write(files: dict[str, bytes], folder: Path) -> Path:
    """Write a rendered project and say where its board is."""
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return next((folder / "kicad").glob("*.kicad_pcb"))


def rule_check(board: Path) -> tuple[list[dict], list[dict]]:
    """Violations and unconnected items by KiCad's rule check, at every severity."""
    report = board.parent.parent / "drc.json"
    command = ["kicad-cli", "pcb", "drc", "--format", "json", "--severity-all", "--exit-code-violations"]
    done = subprocess.run([*command, "-o", report, board], capture_output=True, text=True, timeout=60)
    assert done.returncode in (0, 5), done.stdout + done.stderr
    result = json.loads(report.read_text())
    assert (done.returncode == 5) == bool(result["violations"] or result["unconnected_items"])
    return result["violations"], result["unconnected_items"]


def kinds(board: Path) -> set[str]:
    """The kinds of everything that the rule check complains about."""
    violations, unconnected = rule_check(board)
    return {item["type"] for item in violations + unconnected}


def plots(board: Path) -> dict[str, Path]:
    """KiCad's own Gerber files by layer (``F_Cu`` ...) and its drill file as ``drill``, from the drill-file origin."""
    folder = board.parent.parent / "plots"
    folder.mkdir()
    for what, *origin in (("gerbers", "--use-drill-file-origin"), ("drill", "--drill-origin", "plot")):
        command = ["kicad-cli", "pcb", "export", what, *origin, "-o", f"{folder}/", board]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stdout + done.stderr
    stem = board.stem
    result = {path.stem.removeprefix(f"{stem}-"): path for path in folder.glob(f"{stem}-*.g*")}
    return result | {"drill": folder / f"{stem}.drl"}
