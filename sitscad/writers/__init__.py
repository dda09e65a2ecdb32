"""The formats that a package is written in. A new format is one module here with a `render`, and one row of WRITERS."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from sitscad.record import record
from sitscad.spec.sensor import SensorSpec


@record
class Writer:
    """One format: the module of this package that renders it, the stage of `build` it belongs to, and what it takes.

    ``takes`` names the arguments of the module's ``render`` in their order, out of ``layout``, ``solids``, ``spec``,
    ``estimates``, ``panel`` (None where none is wanted), ``coupon_estimates``, ``forced`` (why the package ought not to
    be ordered from, mostly empty) and ``files`` (those that the same stage made before); ``applies`` says whether a
    spec has anything to write in this format. The module is imported when it renders, not before.
    """

    module: str
    stage: str
    takes: tuple[str, ...] = ("layout",)
    applies: Callable[[SensorSpec], bool] = lambda spec: True

    def render(self, *values: object) -> dict[str, bytes]:
        """The finished files by their paths inside the package."""
        return import_module(f"sitscad.writers.{self.module}").render(*values)


def _is_cut(spec: SensorSpec) -> bool:
    return spec.elastomer is not None or spec.target is not None


def _is_mounted(spec: SensorSpec) -> bool:
    return spec.mount is not None


WRITERS: tuple[Writer, ...] = (
    Writer("gerber", "gerber"),
    Writer("excellon", "gerber"),
    Writer("drill_map", "gerber"),
    Writer("ipc356", "gerber"),
    Writer("placement", "gerber", ("layout", "estimates"), applies=lambda spec: spec.readout.chip is not None),
    Writer("gerber_job", "gerber"),
    Writer("fabrication_notes", "gerber", ("layout", "panel", "files", "forced")),
    Writer("board_picture", "gerber"),
    Writer("board_drawing", "gerber", ("layout", "forced", "files")),
    Writer("stackup_drawing", "gerber", ("layout", "forced", "files")),
    Writer("panel", "gerber", ("panel", "files")),
    Writer("panel_drawing", "gerber", ("panel", "coupon_estimates", "forced", "files")),
    Writer("order_archive", "gerber", ("layout", "panel", "forced", "files")),
    Writer("kicad", "kicad"),
    Writer("laser_dxf", "laser", applies=_is_cut),
    Writer("laser_svg", "laser", applies=_is_cut),
    Writer("assembly_drawing", "laser", ("layout", "forced"), _is_cut),
    Writer("step", "mount", ("solids", "spec"), _is_mounted),
    Writer("assembly_picture", "mount", ("solids", "spec"), _is_mounted),
    Writer("mesh_stl", "mesh", ("solids", "spec"), _is_mounted),
    Writer("mesh_3mf", "mesh", ("solids", "spec"), _is_mounted),
    Writer("volume_mesh", "mesh", ("solids", "spec"), lambda spec: spec.elastomer is not None),
    Writer("firmware", "firmware", ("spec", "estimates")),
    Writer("bom", "report", ("layout", "estimates")),
)
"""Every format, in the order in which a package is made."""
