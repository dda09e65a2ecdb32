"""The picture of the wings in docs/house.md says what is so."""

from __future__ import annotations

import re
import subprocess

import pytest

from tests.test_import_map import PACKAGE, WINGS

TEXT = (PACKAGE.parent / "docs" / "house.md").read_text(encoding="utf-8")
ROWS = [re.split(r"\s*\|\s*", line.strip("| \n")) for line in TEXT.splitlines() if re.match(r"\| `\w+` \|", line)]


def test_every_wing_has_a_row_in_the_order_of_imports():
    assert [row[0].strip("`") for row in ROWS] == [wing for wing in WINGS if wing != "__main__"]


def test_what_is_pointed_at_exists():
    paths = set(re.findall(r"`([a-z_]+/[\w/]+\.(?:py|csv))`", TEXT))
    assert len(paths) > 8
    assert not [path for path in paths if not (PACKAGE / path).is_file() and not path.startswith("tests/")]
    for wing, _, named in ROWS:
        for name in re.findall(r"`([\w/.]+)`", named):
            here = PACKAGE / wing.strip("`") / name
            assert here.exists() or here.with_suffix(".py").is_file(), (wing, name)


def test_every_folder_of_a_wing_is_named():
    for wing, _, named in ROWS:
        folders = {path.name for path in (PACKAGE / wing.strip("`")).iterdir() if (path / "__init__.py").is_file()}
        assert folders <= set(re.findall(r"`(\w+)`", named)), wing


AT_THE_TOP = {
    ".ci", ".github", ".gitignore", ".pre-commit-hooks.yaml", "CHANGELOG.md", "LICENSE", "README.md", "action.yml",
    "constraints.txt", "docs", "outputs", "pyproject.toml", "sitscad", "templates", "tests",
}


@pytest.mark.clients("git")
def test_a_trial_leaves_nothing_at_the_top():
    """Specs and tables that a trial wrote there were committed with it."""
    if not (PACKAGE.parent / ".git").exists():
        pytest.skip("no repository: what is kept in it cannot be told")
    asked = ["git", "-c", "safe.directory=*", "ls-tree", "--name-only", "HEAD"]
    found = subprocess.run(asked, cwd=PACKAGE.parent, capture_output=True, text=True, check=True)
    assert set(found.stdout.split()) == AT_THE_TOP
