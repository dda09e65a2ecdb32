"""A package's folder is replaced as a whole or not at all, whatever happens in between."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from sitscad.package import folder
from sitscad.package.folder import PackageError, opened_for_building, put_in_place, set_aside, write_files


def _contents(directory: Path) -> dict[str, bytes]:
    return {name: (directory / name).read_bytes() for name in folder.list_files(directory)}


def _replace(parent: Path, files: dict[str, bytes], name: str = "pack") -> None:
    with opened_for_building(parent, name) as staged:
        write_files(staged, files)
        put_in_place(staged, parent / name)


@pytest.mark.parametrize("exchanges", [True, False], ids=["exchange", "two renames"])
def test_a_new_package_takes_the_place_of_the_old_one_whole(tmp_path, monkeypatch, exchanges):
    if not exchanges:
        monkeypatch.setattr(folder, "_exchange", lambda one, other: False)
    _replace(tmp_path, {"a/one.txt": b"1", "two.txt": b"2"})
    _replace(tmp_path, {"a/three.txt": b"3"})
    assert _contents(tmp_path / "pack") == {"a/three.txt": b"3"}
    assert os.listdir(tmp_path) == ["pack"], "nothing else is left beside it"


def test_an_exception_while_building_leaves_the_old_package(tmp_path):
    _replace(tmp_path, {"one.txt": b"1"})
    with pytest.raises(KeyboardInterrupt), opened_for_building(tmp_path, "pack") as staged:
        write_files(staged, {"half.txt": b"half"})
        raise KeyboardInterrupt
    assert _contents(tmp_path / "pack") == {"one.txt": b"1"}
    assert os.listdir(tmp_path) == ["pack"]


def _build_and_die(parent: Path, files: dict[str, bytes], instant: int, exchanges: bool) -> int:
    """Build in a child process that kills itself before its n-th step on the disk; the child's exit status."""
    child = os.fork()
    if child:
        return os.waitpid(child, 0)[1]
    steps = [0]

    def counted(real):
        def call(*args, **kwargs):
            if steps[0] == instant:
                os.kill(os.getpid(), signal.SIGKILL)
            steps[0] += 1
            return real(*args, **kwargs)

        return call

    for name in ("rename", "open", "mkdir", "fsync", "unlink", "rmdir"):
        setattr(os, name, counted(getattr(os, name)))
    if not exchanges:
        folder._exchange = lambda one, other: False
    _replace(parent, files)
    os._exit(0)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.parametrize("exchanges", [True, False], ids=["exchange", "two renames"])
def test_killed_at_any_instant_the_old_or_the_new_package_is_whole(tmp_path, exchanges):
    old, new = {"a/one.txt": b"old"}, {"a/one.txt": b"new 1", "two.txt": b"new 2"}
    seen = set()
    for instant in range(60):
        parent = tmp_path / str(instant)
        _replace(parent, old)
        status = _build_and_die(parent, new, instant, exchanges)
        with opened_for_building(parent, "pack"):
            pass  # the next build cleans up
        after = _contents(parent / "pack")
        assert after in (old, new), f"killed at step {instant}"
        assert os.listdir(parent) == ["pack"], f"leftovers after step {instant}"
        seen.add("new" if after == new else "old")
        if status == 0:
            break
        assert os.WTERMSIG(status) == signal.SIGKILL
    else:
        pytest.fail("the build never finished")
    assert seen == {"old", "new"}


def _open(parent: Path, name: str) -> bool:
    """Whether the folder could be opened; it is closed again."""
    with opened_for_building(parent, name) as staged:
        return staged.is_dir()


def test_a_second_build_of_the_same_name_is_refused_and_another_name_is_not(tmp_path):
    with opened_for_building(tmp_path, "pack"):
        with pytest.raises(PackageError, match="another build of pack"):
            _open(tmp_path, "pack")
        assert _open(tmp_path, "other")
    assert _open(tmp_path, "pack")


ESCAPES = ["../x", "/etc/x", "a/../../x", "a//b", "a\\b", ".hidden", "a/.b", "", "a/", "C:x", "a\nb", "a b ", " a"]


@pytest.mark.parametrize("name", ESCAPES)
def test_no_file_name_leaves_the_package(tmp_path, name):
    with pytest.raises(PackageError):
        write_files(tmp_path, {name: b""})
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["", "..", "a/b", "A", "-x", "x" * 65, "x\n"])
def test_no_package_name_leaves_the_output_folder(name):
    with pytest.raises(PackageError):
        folder.require_package_name(name)


def test_changed_files_are_kept_in_a_folder_of_their_own(tmp_path):
    _replace(tmp_path, {"kicad/board.txt": b"mine", "two.txt": b"2"})
    first = set_aside(tmp_path / "pack", ["kicad/board.txt"])
    second = set_aside(tmp_path / "pack", ["two.txt"])
    assert (first.name, second.name) == ("pack.kept-1", "pack.kept-2")
    assert _contents(first) == {"kicad/board.txt": b"mine"}
    assert set_aside(tmp_path / "pack", []) is None


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(PackageError, match="cannot build in"):
        _open(tmp_path / "file", "pack")


def test_packages_are_readable_by_others_as_the_umask_says(tmp_path):
    before = os.umask(0o022)
    try:
        _replace(tmp_path, {"one.txt": b"1"})
    finally:
        os.umask(before)
    assert (tmp_path / "pack").stat().st_mode & 0o777 == 0o755
    assert (tmp_path / "pack" / "one.txt").stat().st_mode & 0o777 == 0o644
