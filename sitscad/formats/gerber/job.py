"""The Gerber job file (.gbrjob) of a set of files: what the board is, which file shows what, and the stack-up."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

from sitscad.fabrication.files import VENDOR, FabricationFile, layer_name, project_guid
from sitscad.fabrication.notes import copper_text
from sitscad.layout.board import Layout
from sitscad.layout.copper import smallest_gaps
from sitscad.spec.circuit import MASK, LayerKind, StackLayer
from sitscad.spec.presets import finish
from sitscad.spec.yaml.source import UNNUMBERED, creation_date
from sitscad.version import __version__


def job_document(layout: Layout, files: Sequence[FabricationFile], size: tuple[float, float]) -> bytes:
    """The job file of a set of files: the board's, or its panel's. ``size`` (m) is that of the outline's middle line.
    The thickness is without the stiffener. Lengths in the file are millimetres.
    """
    software = {"Vendor": VENDOR, "Application": VENDOR, "Version": __version__}
    created, issue = creation_date(), layout.spec.issue
    length, width = size
    name, revision = layout.spec.name, issue.revision or UNNUMBERED
    job: dict[str, Any] = {
        "Header": {
            "GenerationSoftware": software,
            **({"CreationDate": created} if created else {}),
            **({"Comment": issue.title} if issue.rows else {}),
        },
        "GeneralSpecs": {
            "ProjectId": {"Name": name, "GUID": project_guid(name), "Revision": revision},
            "Size": {"X": _mm(length), "Y": _mm(width)},
            "LayerNumber": layout.copper_layers,
            "BoardThickness": _mm(layout.spec.fpc.stackup.thickness),
            "Finish": finish(layout.spec.fpc.finish).job_name,
        },
        "DesignRules": _rules(layout),
        "FilesAttributes": [
            {"Path": file.name, "FileFunction": file.function, "FilePolarity": file.polarity}
            for file in files
        ],
        "MaterialStackup": list(_stackup(layout)),
    }
    return (json.dumps(job, indent=2, ensure_ascii=True) + "\n").encode("ascii")


def _rules(layout: Layout) -> list[dict[str, Any]]:
    """The smallest gap and track of outer and inner copper as drawn; the fabricator's where there is none."""
    rules, gaps, count = layout.spec.fpc.rules, smallest_gaps(layout), layout.copper_layers
    found = []
    for group, layers in {"Outer": {1, count}, "Inner": set(range(2, count))}.items():
        gap = min((near.gap for number, near in gaps.items() if number in layers), default=rules.trace_spacing)
        width = min((trace.width for trace in layout.traces if trace.layer in layers), default=rules.trace_width)
        if layers:
            found.append({"Layers": group, **dict.fromkeys(("PadToPad", "PadToTrack", "TrackToTrack"), _mm(gap)),
                          "MinLineWidth": _mm(width)})
    return found


def _stackup(layout: Layout) -> Iterator[dict[str, Any]]:
    """Every layer from the top; a coverlay is a solder mask in the job file's words, its material says what it is."""
    copper = coverlay = 0
    count = layout.copper_layers
    for layer in layout.spec.fpc.stackup.layers:
        if layer.kind is LayerKind.COPPER:
            copper += 1
            row = {"Type": "Copper", "Thickness": _mm(layer.thickness), "Name": layer_name(copper, count)}
            yield {**row, "Notes": copper_text(layout.spec.fpc.stackup, layer)}
        elif layer.kind is LayerKind.COVERLAY:
            coverlay += 1
            side = "Bottom" if copper else "Top"
            notes = "" if layer.material == MASK else "Flexible coverlay, polyimide film and adhesive together"
            yield _row("SolderMask", layer, f"{side} {layer.material if layer.material == MASK else 'coverlay'}", notes)
        else:
            yield _row("Dielectric", layer, f"{layer_name(copper, count)}/{layer_name(copper + 1, count)}")


def _row(kind: str, layer: StackLayer, name: str, notes: str = "") -> dict[str, Any]:
    row: dict[str, Any] = {"Type": kind, "Thickness": _mm(layer.thickness), "Material": layer.material, "Name": name}
    if kind == "Dielectric" and layer.relative_permittivity is not None:
        row["DielectricConstant"] = layer.relative_permittivity
    return {**row, "Notes": notes} if notes else row


def _mm(length: float) -> float:
    return round(length * 1e3, 6)
