"""What a build has to do with: its stages, and what became of them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import field
from importlib.util import find_spec
from pathlib import Path

from sitscad.record import record
from sitscad.report.findings import CheckedSpec
from sitscad.spec.sensor import SensorSpec
from sitscad.writer import is_felt

CHECK_STAGE = "check"
"""The stage of what every build writes: its checks always run."""

SOLID_STAGES = ("mount", "mesh", "assembly")
"""The stages that need the packages of the extra."""

EXTRA_STAGES = (*SOLID_STAGES, "datasheet")
"""The stages that need packages of the extra: solids, and the plotting library."""

NOTHING_FOR = {
    "laser": "the spec has neither an elastomer nor a target to cut",
    "mount": "the spec has no mount",
    "mesh": "the spec has neither a mount nor an elastomer",
    "assembly": "the spec has no mount",
    "datasheet": "it takes a target that conducts, a pad for it to rest on, and a tank that oscillates",
}
"""Why a stage may have nothing to make."""

KERNELS = ("build123d", "cadquery", "cadquery-ocp", "gmsh", "manifold3d", "trimesh")
"""Packages whose version can change the bytes of solids and meshes."""

FORCED_NOTE = "FORCED.txt"
"""The note of a package that was built in spite of errors, there and beside what goes to a fabricator."""

NOT_WRITTEN = "\nLeft out, because it cannot be written:"
"""With what a forced package's note goes on where something is missing."""

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

    ``left_out`` says of each stage that was not asked for by name why it is missing: a package that is not installed.
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
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def forced(self) -> bool:
        """Whether the package was written in spite of errors."""
        return self.written and not self.checked.is_orderable

    def missing(self, only: Collection[str] = ()) -> dict[str, str]:
        """The stages that the package does not have, each with the reason: those that were left out, and those of
        `only` for which the spec has nothing.
        """
        none = (stage.name for stage in self.stages if stage.outcome == "none" and stage.name in only)
        return {**self.left_out, **{name: NOTHING_FOR.get(name, "the spec has nothing for it") for name in none}}


def unplotted(spec: SensorSpec) -> dict[str, str]:
    """The stage that a build without a plotting library leaves out of a package, with the reason; mostly none.

    Solids and meshes are what a mount is built for, and stop a build where they cannot be made; of the light core, the
    data sheet is the only paper that needs a package of the extra.
    """
    if not is_felt(spec) or find_spec("matplotlib") is not None:
        return {}
    return {"datasheet": "it needs matplotlib, which is not installed: pip install 'sitscad[all]'"}


def version_of(package: str) -> str:
    """The version of an installed package; empty where there is none."""
    from importlib.metadata import PackageNotFoundError, version  # slow to import, and only solids ask

    try:
        return version(package)
    except PackageNotFoundError:
        return ""
