"""Commands where standard streams are closed or full, and where Python runs without asserts, docstrings or UTF-8."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

import sitscad
from sitscad.cli import COMMANDS

SPEC = """sitscad: 1
name: plain
coil: {shape: circle, outer_diameter: 8, turns: 6, layers: 2, trace_width: 0.2, trace_spacing: 0.2}
"""


@pytest.fixture
def spec(tmp_path):
    path = tmp_path / "plain.yaml"
    path.write_text(SPEC, encoding="utf-8")
    return path


def ran(folder, arguments: str, redirected: str = "", flags: str = "", **environment: str):
    """One command line in a shell, in a folder."""
    line = f'exec "{sys.executable}" {flags} -m sitscad {arguments} {redirected}'
    return subprocess.run(
        ["sh", "-c", line], cwd=folder, env={**os.environ, **environment}, capture_output=True, timeout=120,
        stdin=subprocess.DEVNULL, check=False,
    )


@pytest.mark.parametrize(
    ("redirected", "code"),
    [
        (">&-", 0), ("2>&-", 0), ("<&-", 0), ("<&- >&- 2>&-", 0), ("2>/dev/full", 0), (">/dev/full", 2),
        (">/dev/full 2>/dev/full", 2),
    ],
)
def test_closed_or_full_stream_changes_exit_code_only_if_result_is_lost(spec, redirected, code):
    result = ran(spec.parent, "check plain.yaml", redirected)
    assert result.returncode == code, result.stderr
    assert b"internal error" not in result.stderr and b"Traceback" not in result.stderr
    assert (b"No space left" in result.stderr) == (redirected == ">/dev/full")


@pytest.mark.slow
@pytest.mark.parametrize("redirected", ["<&- >&- 2>&-", "2>/dev/full"])
def test_build_with_closed_or_full_streams_writes_complete_package(spec, redirected):
    result = ran(spec.parent, "build plain.yaml -o out --only gerber,firmware", redirected)
    assert result.returncode == 0
    assert sitscad.verify(spec.parent / "out" / "plain").ok


def test_check_of_closed_standard_input_reports_empty_spec(spec):
    result = ran(spec.parent, "check -", "<&-")
    assert (result.returncode, b"SIT001" in result.stdout) == (2, True)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("flags", ["-O", "-OO", "-X utf8=0"])
def test_check_output_does_not_depend_on_python_options(spec, flags):
    locale = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0"} if "utf8" in flags else {}
    result, plain = (ran(spec.parent, "check -v plain.yaml", flags=each, **locale) for each in (flags, ""))
    assert (result.returncode, result.stdout, result.stderr) == (plain.returncode, plain.stdout, plain.stderr)


def test_help_without_docstrings_states_the_reason(spec):
    names = list(COMMANDS)
    code = f"from sitscad.cli import run\nfor name in {names}: run([name, '--help'])"
    line = [sys.executable, "-OO", "-c", code]
    result = subprocess.run(line, capture_output=True, text=True, timeout=120, check=True)
    assert result.stdout.count("takes the help texts away") == len(names)


def test_undecodable_file_name_is_reported_and_nothing_is_written(spec):
    os.rename(spec, os.fsencode(spec.parent) + b"/\xfc.yaml")
    result = ran(spec.parent, "build \"$(printf '\\374').yaml\" -o out --only report")
    assert result.returncode == 2 and b"\\udcfc" in result.stderr and b"internal error" not in result.stderr
    assert not list((spec.parent / "out").glob("*"))
