"""The figures in docs/accuracy.md and the README's summary are those that scripts wrote, and the scripts exist."""

from __future__ import annotations

import csv
import re
from pathlib import Path

from tolerance import approx

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "accuracy.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
with (ROOT / "docs" / "accuracy.csv").open(encoding="utf-8", newline="") as file:
    LINES = {line["comparison"]: line for line in csv.DictReader(file)}


def test_accuracy_page_table_equals_script_output():
    block = PAGE.split("<!-- accuracy.csv begins -->\n")[1].split("<!-- accuracy.csv ends -->")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in block.splitlines()[2:]]
    assert rows == [[cell or "-" for cell in line.values()] for line in LINES.values()]


def test_scripts_named_on_accuracy_page_exist():
    named = set(re.findall(r"[\w/]+\.py\b", PAGE)) | set(re.findall(r"tests/[\w/]+\.py\b", README))
    assert len(named) > 15
    for name in named:
        places = [ROOT / name, ROOT / "tests" / "validation" / name]
        assert any(place.exists() for place in places), name


def test_accuracy_table_has_no_error_above_its_bound():
    bounded = {name: line for name, line in LINES.items() if line["worst_of_bound"]}
    assert len(bounded) >= 15
    for name, line in bounded.items():
        assert float(line["worst_of_bound"]) <= 1.0, name


def test_readme_accuracy_summary_matches_table():
    measured = LINES["measured coils"]
    said = re.search(r"\| against (\d+) measured coils [^|]*\|[^|]*\| median ([\d.]+) %, worst ([\d.]+) % \|", README)
    assert said is not None and said[1] == measured["designs"]
    assert float(said[2]) == approx(100 * float(measured["median_error"]), abs=0.05)
    assert float(said[3]) == approx(100 * float(measured["largest_error"]), abs=0.05)
    windings = [line for name, line in LINES.items() if re.fullmatch(r"winding inductance, \w+", name)]
    assert len(windings) == 7 and all(line["designs"] == "850" for line in windings)
    assert all(float(line["median_error"]) < 1e-5 for line in windings)
    resistances = [line for name, line in LINES.items() if name.startswith("resistance at 10 MHz")]
    assert len(resistances) == 7 and all(float(line["median_error"]) < 0.01 for line in resistances)
