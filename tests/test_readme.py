"""What the README says is so: the library's ten lines, the smallest spec, links. Commands: test_pages."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


@pytest.mark.slow
def test_readme_library_example_runs(tmp_path, monkeypatch, capsys):
    (code,) = blocks("python")
    assert len([line for line in code.splitlines() if line.strip()]) <= 11
    (tmp_path / "templates").symlink_to(ROOT / "templates")
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {})
    assert "C2 pressed" in capsys.readouterr().out
    assert (tmp_path / "outputs/grasper-4layer/fpc/grasper-4layer-F_Cu.gbr").exists()


def test_readme_smallest_spec_loads():
    import sitscad

    (text,) = blocks("yaml")
    assert sitscad.load_text(text, "smallest.yaml").name == "smallest"


PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_repository_links_of_page_target_existing_files(page):
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def anchors(page):
    """Anchors of a page's headings, as code hosts and the site make them."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    titles = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_heading_links_target_existing_headings(page):
    for target, anchor in re.findall(r"\]\(([\w./-]*\.md|)#([^)]+)\)", page.read_text(encoding="utf-8")):
        assert anchor in anchors(page.parent / target if target else page), f"{target}#{anchor}"


def test_readme_has_fewer_than_1100_words():
    text = re.sub(r"^```.*?^```|^<!--.*?-->", "", TEXT, flags=re.DOTALL | re.MULTILINE)
    assert len(text.split()) < 1100


def test_readme_links_every_page():
    """But for the reference of the library, which only the site can show."""
    named = set(re.findall(r"\(docs/([\w-]+\.md)\)", TEXT))
    assert named == {page.name for page in (ROOT / "docs").glob("*.md")} - {"api.md"}
