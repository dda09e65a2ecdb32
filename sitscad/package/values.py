"""What a build has to do with: its stages, and what became of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sitscad.record import record
from sitscad.report.findings import CheckedSpec

CHECK_STAGE = "check"
"""The stage of what every build writes: its checks always run."""

SOLID_STAGES = ("mount", "mesh", "assembly")
"""The stages that need the packages of the extra."""

EXTRA_STAGES = (*SOLID_STAGES, "datasheet")
"""The stages that need packages of the extra: solids, and the plotting library."""

KERNELS = ("build123d", "cadquery", "cadquery-ocp", "gmsh", "manifold3d", "trimesh")
"""Packages whose version can change the bytes of solids and meshes."""

Progress = Callable[[str, str, float], None]
"""Called with a stage, what happens (``start``; ``made``, ``kept``, ``dropped``, ``none``, ``stopped``), seconds."""


@record
class StageResult:
    """What became of a stage: ``made``, ``kept`` from the package before, ``dropped``, ``none`` (nothing to make)."""

    name: str
    outcome: str
    files: int
    seconds: float


@record
class BuildResult:
    """The outcome of a build. Without ``written`` the errors in ``checked`` stopped it and nothing was touched.

    ``is_unchanged`` is set where nothing had to be done; ``stale`` says of each file that a build would change what is
    wrong with it, where only that was asked for.
    """

    directory: Path
    checked: CheckedSpec
    written: bool
    stages: tuple[StageResult, ...] = ()
    kept_aside: Path | None = None
    is_unchanged: bool = False
    stale: tuple[str, ...] = ()

    @property
    def forced(self) -> bool:
        """Whether the package was written in spite of errors."""
        return self.written and not self.checked.is_orderable


def version_of(package: str) -> str:
    """The version of an installed package; empty where there is none."""
    from importlib.metadata import PackageNotFoundError, version  # slow to import, and only solids ask

    try:
        return version(package)
    except PackageNotFoundError:
        return ""
