"""The tables of the code in docs/house.md and docs/CONTRIBUTING.md are correct."""

from __future__ import annotations

import re
import subprocess

import pytest

from tests.test_import_map import PACKAGE, WINGS

DOCS = PACKAGE.parent / "docs"
TEXT, CONTRIBUTING = ((DOCS / name).read_text(encoding="utf-8") for name in ("house.md", "CONTRIBUTING.md"))
ROWS = [re.split(r"\s*\|\s*", line.strip("| \n")) for line in TEXT.splitlines() if re.match(r"\| `\w+` \|", line)]


def test_every_wing_has_a_row_in_the_order_of_imports():
    assert [row[0].strip("`") for row in ROWS] == [wing for wing in WINGS if wing != "__main__"]


def test_what_is_pointed_at_exists():
    for text in (TEXT, CONTRIBUTING):
        paths = set(re.findall(r"`([a-z_]+/[\w/]+\.(?:py|csv))`", text))
        assert len(paths) > 8
        assert not [path for path in paths if not any((top / path).is_file() for top in (PACKAGE, PACKAGE.parent))]
    for wing, _, named in ROWS:
        for name in re.findall(r"`([\w/.]+)`", named):
            here = PACKAGE / wing.strip("`") / name
            assert here.exists() or here.with_suffix(".py").is_file(), (wing, name)


def test_every_folder_of_a_wing_is_named():
    for wing, _, named in ROWS:
        folders = {path.name for path in (PACKAGE / wing.strip("`")).iterdir() if (path / "__init__.py").is_file()}
        assert folders <= set(re.findall(r"`(\w+)`", named)), wing


AT_THE_TOP = {
    ".ci", ".github", ".gitignore", ".pre-commit-hooks.yaml", "CHANGELOG.md", "CITATION.cff", "LICENSE", "README.md",
    "action.yml", "constraints.txt", "docs", "outputs", "pyproject.toml", "sitscad", "templates", "tests",
}


@pytest.mark.clients("git")
def test_a_trial_leaves_nothing_at_the_top():
    """Specs and tables that a trial wrote there were committed with it."""
    if not (PACKAGE.parent / ".git").exists():
        pytest.skip("no repository: what is kept in it cannot be told")
    asked = ["git", "-c", "safe.directory=*", "ls-tree", "--name-only", "HEAD"]
    found = subprocess.run(asked, cwd=PACKAGE.parent, capture_output=True, text=True, check=True)
    assert set(found.stdout.split()) == AT_THE_TOP
