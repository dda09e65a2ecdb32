"""`sitscad new`: a spec to start from."""

from __future__ import annotations

import click

import sitscad
from sitscad.cli.asking import Example
from sitscad.cli.telling import print_result, say


@click.command(cls=Example, example="sitscad new grasper_4layer -o sensor.yaml")
@click.argument("template", required=False)
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="The file to write (default: TEMPLATE.yaml).")
@click.option("--list", "list_them", is_flag=True, help="List the templates and write nothing.")
@click.option("--force", is_flag=True, help="Write over an existing file.")
def new(template: str | None, output: str | None, list_them: bool, force: bool) -> int:
    """Write a commented spec to start from.

    TEMPLATE is grasper_4layer unless another is named; --list names them all.
    """
    if list_them:
        described = sitscad.list_templates()
        width = max(map(len, described), default=0)
        print_result("\n".join(f"{name:<{width}}  {text}" for name, text in described.items()))
        return 0
    named = {} if template is None else {"name": template}
    path = sitscad.write_template(path=output, force=force, **named)
    print_result(str(path))
    if (schema := sitscad.write_schema(path.parent)) is not None:
        say(f"wrote {schema}, from which editors complete and validate specs")
    say(f"wrote {path}; next: sitscad check {path}")
    return 0
