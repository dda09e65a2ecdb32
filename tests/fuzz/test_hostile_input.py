"""The fuzzers in small: in_large.py beside this has them in large."""

from __future__ import annotations

import os
import random
import subprocess
import threading
from pathlib import Path

import in_large
import killed
import pytest
from hostile import mutated

import sitscad

TEXT = killed.spec_text(8.5)


@pytest.mark.parametrize("seed", range(4))
def test_mutated_texts_load_or_raise_spec_error(seed):
    rng = random.Random(f"loads {seed}")
    for _ in range(250):
        in_large.load(mutated(rng))


@pytest.mark.parametrize("seed", range(3))
def test_check_of_mutated_specs_completes(seed):
    rng = random.Random(f"checks {seed}")
    for _ in range(10):
        in_large.check(mutated(rng))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_killed_build_leaves_complete_package(tmp_path, seed):
    assert killed.killed_build(tmp_path, random.Random(f"kills {seed}")) in ("old", "new")


def built(folder: Path, turns: float = 8.5) -> sitscad.BuildResult:
    return sitscad.build(sitscad.load_text(killed.spec_text(turns), "killed.yaml"), folder, killed.ONLY)


def test_concurrent_builds_in_one_folder_leave_complete_package(tmp_path):
    """Each ends well, or says that the other is at work; what stands there is one whole package."""
    outcomes: list[str] = []

    def build_one(turns: float) -> None:
        try:
            outcomes.append("built" if built(tmp_path, turns).written else "stopped")
        except sitscad.PackageError as error:
            outcomes.append("busy" if "another build" in str(error) else str(error))

    threads = [threading.Thread(target=build_one, args=(turns,)) for turns in (8.5, 9.5, 10.5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=300)
    assert len(outcomes) == 3 and set(outcomes) <= {"built", "busy"} and "built" in outcomes
    killed.require_whole(tmp_path / "killed")
    assert [path.name for path in tmp_path.iterdir()] == ["killed"]


@pytest.mark.slow
@pytest.mark.parametrize("failing", ["write", "fsync", "rename"])
def test_build_on_simulated_full_disk_keeps_previous_package(tmp_path, monkeypatch, failing):
    """The system refuses at one call after another, as a full or failing disk does."""
    before = killed.require_whole(built(tmp_path).directory)
    real = {"write": os.fsync, "fsync": os.fsync, "rename": os.rename}[failing]
    for allowed in range(0, 12, 3):
        calls = iter(range(allowed))

        def refuse(*arguments, calls=calls, **named):
            if next(calls, None) is None:
                raise OSError(28, "No space left on device")
            return real(*arguments, **named)

        with monkeypatch.context() as patch:
            patch.setattr(os, "rename" if failing == "rename" else "fsync", refuse)
            if failing == "rename":
                patch.setattr("sitscad.package.building._exchange", lambda *_: False)
            try:
                built(tmp_path, 9.5)
            except sitscad.PackageError as error:
                assert "No space left on device" in str(error)
        if (tmp_path / "killed").is_dir():
            killed.require_whole(tmp_path / "killed")
    assert killed.require_whole(built(tmp_path).directory) == before
    assert [path.name for path in tmp_path.iterdir()] == ["killed"]


@pytest.mark.skipif(not Path("/proc/self/mountinfo").exists(), reason="no Linux")
def test_build_on_full_tmpfs_keeps_previous_package(tmp_path):
    """A small file system in memory, where the machine lets one be mounted."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=700k", "none", str(place)], capture_output=True)
    if mount.returncode:
        pytest.skip("this machine mounts nothing")
    try:
        small = sitscad.load_text(TEXT, "killed.yaml")
        before = killed.require_whole(sitscad.build(small, place, ("firmware",)).directory)
        (place / "filler").write_bytes(b"x" * 450_000)
        with pytest.raises(sitscad.PackageError, match="No space left on device"):
            sitscad.build(small, place, ("gerber", "kicad", "report"))
        assert killed.require_whole(place / "killed") == before
        assert {path.name for path in place.iterdir()} == {"killed", "filler"}
    finally:
        subprocess.run(["umount", str(place)], check=False)


def test_build_into_read_only_folder_is_refused_without_change(tmp_path, open_folder, as_a_user):
    """One sentence, and nothing is changed."""
    built(tmp_path)  # and everything is imported
    open_folder.chmod(0o555)
    with as_a_user(), pytest.raises(sitscad.PackageError, match="Permission denied"):
        built(open_folder)
    assert not list(open_folder.iterdir())


def test_build_preserves_foreign_files_and_follows_no_links(tmp_path):
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "precious.txt").write_text("precious")
    out = tmp_path / "out"
    package = built(out).directory
    (package / "mine.txt").write_text("mine")
    (package / "linked").symlink_to(outside)
    (package / "report.html").unlink()
    (package / "report.html").symlink_to(outside / "precious.txt")
    result = built(out, 9.5)
    assert result.kept_aside is not None and (result.kept_aside / "mine.txt").read_text() == "mine"
    assert (result.kept_aside / "linked").is_symlink()
    killed.require_whole(package)
    assert (outside / "precious.txt").read_text() == "precious" and len(list(outside.iterdir())) == 1


@pytest.mark.parametrize("what", ["a link", "a file", "a folder of somebody", "a link to nowhere"])
def test_build_never_replaces_foreign_file_link_or_folder(tmp_path, what):
    place, other = tmp_path / "killed", tmp_path / "other"
    if what == "a link":
        other.mkdir()
        place.symlink_to(other)
    elif what == "a link to nowhere":
        place.symlink_to(other)
    elif what == "a file":
        place.write_text("mine")
    else:
        place.mkdir()
        (place / "mine.txt").write_text("mine")
    before = sorted(str(path) for path in tmp_path.rglob("*"))
    with pytest.raises(sitscad.PackageError, match="was not touched"):
        built(tmp_path)
    assert sorted(str(path) for path in tmp_path.rglob("*")) == before
