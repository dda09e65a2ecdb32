"""`sitscad explain`, `rules` and `schema`: what sitscad itself knows."""

from __future__ import annotations

import json

import click

import sitscad
from sitscad.cli.asking import PLUGIN, Example, require_rule, row_of
from sitscad.cli.telling import print_result


@click.command(cls=Example, example="sitscad explain SIT201")
@click.argument("rule")
@PLUGIN
def explain(rule: str) -> int:
    """Say what RULE checks, why, and how to mend it.

    RULE is an identifier (SIT103), its number (103) or the rule's name (coil-trace).
    """
    found = require_rule(rule)
    if found is None:
        raise click.UsageError(f"{rule!r} stands for several rules; `sitscad rules` lists them.")
    parts = (found.summary, f"Why: {found.why}", f"To mend it: {found.mend}", f"Source: {found.source}")
    print_result("\n\n".join((f"{found.id} {found.name} ({found.severities})", *parts)))
    return 0


@click.command(cls=Example, example="sitscad rules")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json|markdown")
@PLUGIN
def rules(format_name: str) -> int:
    """List every rule with its severities.

    json and markdown have all its texts.
    """
    print_result(row_of(sitscad.RULE_FORMATS, format_name, "--format")(tuple(sitscad.all_rules())))
    return 0


@click.command(cls=Example, example="sitscad schema > sitscad.schema.json")
@click.option(
    "--of",
    "document",
    default="spec",
    show_default=True,
    metavar="spec|check|calibration",
    help="check: what its --format json prints; calibration: calibration.json.",
)
def schema(document: str) -> int:
    """Print the JSON Schema of the spec.

    Editors complete and validate from it. --of prints that of what `check` or `calibrate` write for programs.
    """
    print_result(json.dumps(row_of(sitscad.SCHEMAS, document, "--of")(), indent=1))
    return 0
