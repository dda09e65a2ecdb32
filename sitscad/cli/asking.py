"""What commands ask for alike: options, names and patterns; a usage error says what is wrong with them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import click

import sitscad
from sitscad.cli.telling import say

if TYPE_CHECKING:
    from sitscad import Baseline, CheckedSpec


class Example(click.Command):
    """A command whose help ends with one example."""

    def __init__(self, name: str | None, *, example: str, **kwargs: Any) -> None:
        super().__init__(name, **{**kwargs, "epilog": f"\b\nExample:\n  {example}"})


class Group(click.Group):
    """Commands that are listed in the order in which they are used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The commands in the order in which they were added."""
        return list(self.commands)


class Names(click.ParamType):
    """Comma-separated names."""

    name = "name,..."

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[str, ...]:
        """The names without blanks."""
        return value if isinstance(value, tuple) else tuple(part.strip() for part in value.split(",") if part.strip())


class Tolerance(click.FloatRange):
    """A relative error above 0, 1 at most; nan, which lies in no range and which click lets through, is none."""

    def __init__(self) -> None:
        super().__init__(0, 1, min_open=True)

    def convert(self, value: Any, param: Any, ctx: Any) -> float:
        """The number."""
        found = float(super().convert(value, param, ctx))
        if found != found:
            self.fail(f"{value} is not in the range {self._describe_range()}.", param, ctx)
        return found


JOBS = click.option("--jobs", type=click.IntRange(1), help="Processes for several specs (default: the processors).")


def _use_plugins(_: click.Context, __: click.Parameter, files: tuple[str, ...]) -> None:
    """Put installed plugins in force, and those of the files that are named."""
    sitscad.use_installed_plugins()
    for file in files:
        sitscad.use_plugin(file)


PLUGIN = click.option(
    "--plugin", multiple=True, metavar="FILE", type=click.Path(), expose_value=False, is_eager=True,
    callback=_use_plugins, help="A Python file with rules or writers of your own.",
)  # fmt: skip
BASELINE = click.option(
    "--baseline", metavar="FILE", help="What check --format json printed: what it holds does not fail again."
)


def specs_of(paths: Iterable[str]) -> list[str]:
    """The specs that are named, those of folders among them."""
    try:
        return sitscad.specs_in(list(paths))
    except ValueError as error:
        raise click.UsageError(str(error)) from error


def baseline_of(path: str | None) -> Baseline | None:
    """The findings that a file holds; None where no file is named."""
    return None if path is None else sitscad.read_baseline(path)


def tell_of_strangers(baseline: Baseline | None, checked: Iterable[CheckedSpec]) -> None:
    """Say which specs a baseline knows nothing of, where they have findings: none of these was known before."""
    for spec in checked:
        if baseline is not None and spec.findings and not baseline.holds(spec.path, spec.name):
            named = f" named {spec.name}" if spec.name else ""
            say(
                f"{spec.path}: {baseline.named} holds no spec{named} at this path (its paths count from its own folder)"
            )


def require_rule(pattern: str) -> Any:
    """The one rule that a pattern stands for, None for several; a usage error for none."""
    known = sitscad.all_rules()
    found = [rule for rule in known if sitscad.stands_for(pattern, rule.id, rule.name)]
    if not found:
        meant = _meant(pattern, (r.name for r in known))
        raise click.UsageError(f"There is no rule {pattern!r}.{meant} `sitscad rules` lists them all.")
    return found[0] if len(found) == 1 else None


def row_of(table: Any, name: str, option: str) -> Any:
    """A row of a table of formats or methods; a usage error that lists them for any other name."""
    if name not in table:
        raise click.BadParameter(f"{name!r} is not one of {', '.join(table)}.{_meant(name, table)}", param_hint=option)
    return table[name]


def _meant(name: str, known: Iterable[str]) -> str:
    """A sentence that names the known one nearest to a name; empty where none is near."""
    import difflib

    near = difflib.get_close_matches(name.lower(), list(known), n=1)
    return f" Did you mean {near[0]}?" if near else ""
