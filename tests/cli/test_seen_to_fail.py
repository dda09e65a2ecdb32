"""Specs and calls that once crashed, hung or read nonsense: each now gets an answer."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import sitscad
from sitscad.cli import cli

COIL = "coil: {shape: circle, outer_diameter: 8, turns: 14, layers: 2, trace_width: 0.1, trace_spacing: 0.1}\n"


def checked(text, tmp_path, hints="decisive"):
    spec = tmp_path / "seen.yaml"
    spec.write_text(f"sitscad: 1\nname: seen\n{text}", encoding="utf-8")
    return sitscad.check(sitscad.load(spec), hints=hints)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("conductivity", ["0 S/m", "1e-300 S/m", "1 S/m"])
def test_nearly_insulating_target_yields_error(tmp_path, conductivity):
    result = checked(f"{COIL}target: {{size: 8, material: {{conductivity: {conductivity}}}}}\n", tmp_path, "none")
    (findings,) = (finding for finding in result.findings if finding.rule == "SIT305")
    assert findings.cases[0] == "poor-conductor" and findings.severity == sitscad.Severity.ERROR


@pytest.mark.slow
@pytest.mark.filterwarnings("error")
def test_thick_board_close_to_shield_has_finite_numbers(tmp_path):
    stackup = "fpc: {stackup: [{copper: 35 um}, {dielectric: 4}, {copper: 35 um}]}\n"
    text = COIL + stackup + "target: {size: 8}\nshield: {gap: 0.001}\n"
    result = checked(text, tmp_path, "none")
    assert result.findings and not any("nan" in finding.message for finding in result.findings)


def test_rounded_square_coil_has_no_spacing_finding(tmp_path):
    square = "coil: {shape: square, outer_diameter: 8, turns: 12, layers: 2, trace_width: 0.1, trace_spacing: 0.1, "
    result = checked(square + "corner_radius: 0.5}\n", tmp_path)
    assert not [finding for finding in result.findings if finding.rule == "SIT108"]


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no /dev/zero here")
def test_endless_file_is_refused():
    result = CliRunner().invoke(cli, ["check", "/dev/zero"], standalone_mode=False)
    assert result.return_value == 2 and "SIT011" in result.stdout


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
def test_full_disk_error_is_not_reported_as_internal_error(tmp_path):
    spec = tmp_path / "seen.yaml"
    spec.write_text(f"sitscad: 1\nname: seen\n{COIL}", encoding="utf-8")
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "sitscad", "check", str(spec)],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            env=os.environ | {"PYTHONPATH": str(Path(sitscad.__file__).parents[1])},
        )
    assert done.returncode == 2 and "No space left" in done.stderr and "fault of sitscad" not in done.stderr


def test_tolerance_nan_exits_2(tmp_path):
    result = CliRunner().invoke(cli, ["estimate", "any.yaml", "--tolerance", "nan"])
    assert result.exit_code == 2 and "--tolerance" in result.stderr


def test_verify_of_coil_without_contacts_fails(tmp_path):
    pytest.importorskip("gerbonara", reason="verify reads Gerbers through gerbonara, which sitscad[all] brings")
    spec = tmp_path / "seen.yaml"
    coil = COIL.replace("layers: 2", "layers: 1").replace("turns: 14", "turns: 8")
    spec.write_text(f"sitscad: 1\nname: seen\n{coil}fpc: {{stackup: [{{copper: 35 um}}]}}\n", encoding="utf-8")
    sitscad.build(sitscad.load(spec), tmp_path / "out", only=("gerber", "kicad"), force=True)
    result = sitscad.verify(tmp_path / "out/seen")
    assert not result.ok and any("no way out" in difference for difference in result.differences)


DAMPED = COIL.replace("0.1", "0.05") + "readout: {device: ldc1614, capacitance: 1 uF}\n"


def test_overdamped_tank_is_reported_without_frequency(tmp_path):
    """It was estimated to run at 1e-10 mHz, and rules for low frequencies gave advice on that."""
    result = checked(DAMPED, tmp_path)
    (finding,) = [finding for finding in result.findings if finding.rule == "SIT203"]
    assert "overdamped" in finding.cases and finding.severity.value == "error"
    assert not {"SIT202", "SIT305"} & {finding.rule for finding in result.findings}
    (coil,) = sitscad.estimate(sitscad.lay_out(sitscad.load(tmp_path / "seen.yaml"))).coils
    assert not coil.states and "overdamped: Q 0." in coil.failed_states["free"]


@pytest.mark.parametrize("command", [["check"], ["estimate"], ["estimate", "--format", "json"], ["build", "--force"]])
@pytest.mark.parametrize("cause", ["damped", "unresolved"])
def test_design_without_computable_states_yields_finding_without_traceback(tmp_path, monkeypatch, command, cause):
    monkeypatch.chdir(tmp_path)
    if cause == "unresolved":
        monkeypatch.setattr("sitscad.kernels.electromagnetics.loss.current_modes.TRUSTED", -1.0)
    text = DAMPED if cause == "damped" else COIL + "target: {size: 8}\nelastomer: {thickness: 1}\n"
    (tmp_path / "seen.yaml").write_text(f"sitscad: 1\nname: seen\n{text}", encoding="utf-8")
    words = [*command, "--only", "firmware,report"] if command[0] == "build" else command
    done = CliRunner().invoke(cli, [*words, "seen.yaml"])
    assert done.exception is None or isinstance(done.exception, SystemExit)
    assert not re.search(r"\bnan\b", done.output, re.IGNORECASE)
    if command[0] == "check":
        assert ("SIT203 error" if cause == "damped" else "SIT201 error") in done.output


def test_large_coil_of_thick_copper_has_expected_resistance_ratio(tmp_path):
    """70 mm, 8 turns of 1.5 mm in 0.35 mm copper: too few points for the modes' orders made every state fail."""
    stackup = "fpc: {stackup: [{copper: 350 um}, {dielectric: 0.1}, {copper: 350 um}]}\n"
    spec = tmp_path / "seen.yaml"
    coil = "coil: {shape: circle, outer_diameter: 70, turns: 8, trace_width: 1.5, trace_spacing: 1.5}\n"
    spec.write_text(f"sitscad: 1\nname: seen\n{coil}{stackup}", encoding="utf-8")
    (result,) = sitscad.estimate(sitscad.lay_out(sitscad.load(spec))).coils
    assert not result.failed_states
    # a skin of 22 um all round would be 6.6 times the direct current's; neighbours about double that
    assert 8.0 < result.resistance_ac / result.resistance_dc < 16.0


def target_of(material, tmp_path):
    """What is checked and estimated of a target over the whole coil."""
    spec = tmp_path / "seen.yaml"
    parts = f"target: {{size: 8, thickness: 0.2, material: {material}}}\nelastomer: {{thickness: 1.5}}\n"
    spec.write_text(f"sitscad: 1\nname: seen\n{COIL}{parts}", encoding="utf-8")
    read = sitscad.load(spec)
    return sitscad.check(read), sitscad.estimate(sitscad.lay_out(read))


def test_ferrite_target_needs_no_skin_depth_thickness(tmp_path):
    """SIT305 asked for 0.4 m of ferrite, and its share of an endless plate's effect was that of a conductor."""
    result, results = target_of("ferrite", tmp_path)
    assert "SIT305" not in [finding.rule for finding in result.findings]
    assert any("SIT305" in str(row) and "ferrite" in str(row) for row in result.not_checked)
    (coil,) = results.coils
    assert coil.states["rest"].inductance > coil.states["free"].inductance
    assert results.is_solved and coil.states["rest"].target_change_error < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("material", ["stainless-17-4ph", "copper"])
def test_inductance_change_error_of_large_target_is_below_10_percent(material, tmp_path):
    """The share of an endless steel was known to 55 %, and R with it."""
    result = target_of(material, tmp_path)[1]
    assert result.is_solved and result.coils[0].states["rest"].target_change_error < 0.1
