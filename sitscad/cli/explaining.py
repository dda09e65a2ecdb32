"""`sitscad explain` and `rules`: the texts of the rules."""

from __future__ import annotations

import click

from sitscad.checks.findings.text import RULE_FORMATS
from sitscad.checks.judging import Rule, all_rules
from sitscad.checks.judging import explain as explain_rule
from sitscad.checks.policy import matches_rule
from sitscad.cli.terminal import PLUGIN, Example, print_result, row_of, suggestion


def rules_for(pattern: str) -> list[Rule]:
    """Return the rules that match a pattern. Raises a usage error if there are none."""
    rules = all_rules()
    matching = [rule for rule in rules if matches_rule(pattern, rule.id, rule.name)]
    if not matching:
        near = suggestion(pattern, (rule.name for rule in rules))
        raise click.UsageError(f"There is no rule {pattern!r}.{near} `sitscad rules` lists them all.")
    return matching


@click.command(cls=Example, example="sitscad explain SIT201 coil-trace")
@click.argument("rules", nargs=-1, required=True)
@PLUGIN
def explain(rules: tuple[str, ...]) -> int:
    """Explain RULES: their condition, reason, remedy and source.

    A rule is an identifier (SIT103), its number (103) or its name (coil-trace). The beginning of identifiers (SIT2)
    means all rules with this beginning.
    """
    identifiers = dict.fromkeys(rule.id for pattern in rules for rule in rules_for(pattern))
    print_result("\n\n\n".join(map(explain_rule, identifiers)))
    return 0


@click.command(cls=Example, example="sitscad rules")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json|markdown")
@PLUGIN
def rules(format_name: str) -> int:
    """List every rule with its severities.

    json and markdown have the complete texts.
    """
    print_result(row_of(RULE_FORMATS, format_name, "--format")(tuple(all_rules())))
    return 0
