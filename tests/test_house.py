"""The tables of the code in docs/house.md and docs/CONTRIBUTING.md are correct."""

from __future__ import annotations

import re
import subprocess

import pytest

from tests.test_import_map import PACKAGE, WINGS

DOCS = PACKAGE.parent / "docs"
TEXT, CONTRIBUTING = ((DOCS / name).read_text(encoding="utf-8") for name in ("house.md", "CONTRIBUTING.md"))
ROWS = [re.split(r"\s*\|\s*", line.strip("| \n")) for line in TEXT.splitlines() if re.match(r"\| `\w+` \|", line)]


def test_house_page_lists_wings_in_import_order():
    assert [row[0].strip("`") for row in ROWS] == [wing for wing in WINGS if wing != "__main__"]


def test_files_named_on_house_pages_exist():
    for text in (TEXT, CONTRIBUTING):
        paths = set(re.findall(r"`([a-z_]+/[\w/]+\.(?:py|csv))`", text))
        assert len(paths) > 8
        assert not [path for path in paths if not any((top / path).is_file() for top in (PACKAGE, PACKAGE.parent))]
    for wing, _, named in ROWS:
        for name in re.findall(r"`([\w/.]+)`", named):
            here = PACKAGE / wing.strip("`") / name
            assert here.exists() or here.with_suffix(".py").is_file(), (wing, name)


def test_house_page_names_every_folder_of_a_wing():
    for wing, _, named in ROWS:
        folders = {path.name for path in (PACKAGE / wing.strip("`")).iterdir() if (path / "__init__.py").is_file()}
        assert folders <= set(re.findall(r"`(\w+)`", named)), wing


AT_THE_TOP = {
    ".ci", ".github", ".gitignore", ".pre-commit-hooks.yaml", "CHANGELOG.md", "CITATION.cff", "LICENSE", "README.md",
    "action.yml", "constraints.txt", "docs", "outputs", "pyproject.toml", "sitscad", "templates", "tests",
}


@pytest.mark.clients("git")
def test_repository_root_contains_only_expected_entries():
    """Specs and tables that a trial wrote there were committed with it."""
    if not (PACKAGE.parent / ".git").exists():
        pytest.skip("no repository: what is kept in it cannot be told")
    request = ["git", "-c", "safe.directory=*", "ls-tree", "--name-only", "HEAD"]
    result = subprocess.run(request, cwd=PACKAGE.parent, capture_output=True, text=True, check=True)
    assert set(result.stdout.split()) == AT_THE_TOP
