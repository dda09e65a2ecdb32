"""What the README shows is what the program does: commands with their output, the library's ten lines, the pictures."""

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner
from tolerance import approx

from sitscad.cli import cli

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("block", blocks("console"), ids=lambda block: block.splitlines()[0])
def test_console_blocks_are_real_output(block, monkeypatch):
    monkeypatch.chdir(ROOT)
    command, _, expected = block.partition("\n")
    words = shlex.split(command.removeprefix("$ "))
    assert words[0] == "sitscad"
    assert CliRunner().invoke(cli, words[1:]).stdout == expected


def test_the_ten_lines_of_library_run(tmp_path, monkeypatch, capsys):
    (code,) = blocks("python")
    assert len([line for line in code.splitlines() if line.strip()]) <= 11
    (tmp_path / "templates").symlink_to(ROOT / "templates")
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {})
    assert "C2 pressed" in capsys.readouterr().out
    assert (tmp_path / "outputs/grasper-4layer/fpc/grasper-4layer-F_Cu.gbr").exists()


def test_the_smallest_spec_is_whole():
    import sitscad

    (text,) = blocks("yaml")
    assert sitscad.load_text(text, "smallest.yaml").name == "smallest"


def test_the_table_of_templates_is_what_they_give():
    import sitscad

    rows = re.findall(r"^\| `(\w+)` \| ([\d.]+) uH \| ([\d. /]+) kohm \| ([\d. /]*)V? ?\| ([\d.]+) MHz \|", TEXT, re.M)
    assert len(rows) == 4
    for name, inductance, resistances, amplitudes, highest in rows:
        first = sitscad.estimate(sitscad.lay_out(sitscad.load(ROOT / "templates" / f"{name}.yaml"))).coils[0]
        states = list(first.states.values())
        assert f"{first.states['free'].inductance * 1e6:.2f}" == inductance
        for shown, state in zip(resistances.split("/"), states, strict=True):
            assert float(shown) * 1e3 == approx(state.parallel_resistance, rel=0.05)
        for shown, state in zip(filter(str.strip, amplitudes.split("/")), states[1:], strict=False):
            assert float(shown) == approx(state.amplitude, abs=0.011)
        assert float(highest) * 1e6 == approx(max(state.frequency for state in states), rel=0.01)


def test_pictures_are_the_ones_that_the_tool_makes():
    import sitscad
    from sitscad.papers.board_pictures import render

    layout = sitscad.lay_out(sitscad.load(ROOT / "templates/grasper_4layer.yaml"))
    drawn = render(layout)["fpc/grasper-4layer-body.svg"]
    assert (ROOT / "docs/grasper-4layer-body.svg").read_bytes() == drawn
    from sitscad.papers.drawings import jaw

    drawn = jaw.render(layout, "")["mount/grasper-4layer-jaw-drawing.svg"]
    assert (ROOT / "docs/grasper-4layer-jaw-drawing.svg").read_bytes() == drawn


PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_into_the_repository_leads_somewhere(page):
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def test_the_readme_is_read_in_three_minutes():
    told = re.sub(r"^```.*?^```", "", TEXT, flags=re.DOTALL | re.MULTILINE)
    assert len(told.split()) < 1100


def test_every_page_is_reached_from_the_readme():
    """Or from the site's contents, which the readme names; the rest are pages that only the site can show."""
    named = set(re.findall(r"\(docs/([\w-]+\.md)\)", TEXT))
    assert named <= {page.name for page in (ROOT / "docs").glob("*.md")}
    shown = {page.name for page in (ROOT / "docs").glob("*.md") if "```{" not in page.read_text(encoding="utf-8")}
    assert shown - {"api.md", "rules.md"} <= named and "index.md" in named
