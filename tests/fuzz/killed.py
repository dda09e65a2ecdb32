"""Builds killed at random moments: what stands in the package's place is always a whole package, the old or the new."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import sitscad
from sitscad.package.manifest import read_intact_files, read_manifest

ROOT = Path(__file__).parents[2]
TEXT = """\
sitscad: 1
name: killed
coil: {shape: circle, outer_diameter: 10, turns: TURNS, layers: 2, trace_width: 160 um, trace_spacing: 160 um}
"""
ONLY = ("gerber", "kicad", "firmware", "report")


def spec_text(turns: float) -> str:
    """A spec that builds in well under a second."""
    return TEXT.replace("TURNS", str(turns))


def require_whole(folder: Path) -> str:
    """The hash of the spec that a package was made from; AssertionError where the package is not whole."""
    manifest = read_manifest(folder)
    assert read_intact_files(folder, manifest.files) is not None, f"{folder} is not whole"
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert there == {*manifest.files, "manifest.json"}, f"{folder} holds something else"
    return manifest.spec["sha256"]


def killed_build(folder: Path, rng: random.Random) -> str:
    """Build a package, kill a build of a changed spec at a random moment, and look: ``old`` or ``new`` stands there,
    and the next build cleans up behind it.
    """
    out, path = folder / "outputs", folder / "killed.yaml"
    path.write_text(spec_text(8.5))
    old = require_whole(sitscad.build(sitscad.load(path), out, ONLY).directory)
    path.write_text(spec_text(rng.choice((9.5, 10.5))))
    command = [sys.executable, "-m", "sitscad", "build", str(path), "-o", str(out), "--only", ",".join(ONLY)]
    env = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    process = subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    staged = time.perf_counter()
    if rng.random() < 0.6:  # most of a build's time draws; what matters is when it writes
        while process.poll() is None and not list(out.glob(".killed.new-*")):
            time.sleep(0.001)
            if time.perf_counter() - staged > 60:
                break
        time.sleep(rng.uniform(0.0, 0.25))
    else:
        time.sleep(rng.uniform(0.05, 1.5))
    process.send_signal(signal.SIGKILL)
    process.wait(timeout=60)
    outcome = "old" if require_whole(out / "killed") == old else "new"
    require_whole(sitscad.build(sitscad.load(path), out, ONLY).directory)
    left = [entry.name for entry in out.iterdir() if entry.name != "killed"]
    assert not left, f"left behind: {left}"
    return outcome
