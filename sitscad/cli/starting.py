"""`sitscad new` and `schema`: a spec or a study to start from, and the schemas of files."""

from __future__ import annotations

import functools
import json

import click

from sitscad.apps.study.document import first_study_text, study_schema
from sitscad.cli.terminal import Example, print_message, print_result, row_of
from sitscad.data import json_file
from sitscad.package.example_specs import list_templates, profile_lines, write_schema, write_study, write_template
from sitscad.spec.sensor import json_schema


@click.command(cls=Example, example="sitscad new grasper_4layer -o sensor.yaml")
@click.argument("template", required=False)
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="The file to write (default: TEMPLATE.yaml).")
@click.option("--list", "list_them", is_flag=True, help="List the templates and write nothing.")
@click.option("--force", is_flag=True, help="Write over an existing file.")
@click.option("--study", is_flag=True, help="Write a study, and its base spec if that is missing.")
def new(template: str | None, output: str | None, list_them: bool, force: bool, study: bool) -> int:
    """Write a commented spec to start from.

    TEMPLATE is grasper_4layer by default; --list lists all templates. With --study, write a study of the template for
    `sitscad design`.
    """
    named = {} if template is None else {"name": template}
    if study and not list_them:
        path = write_study(first_study_text, path=output, force=force, **named)
        print_result(str(path))
        print_message(f"wrote {path}; next: sitscad design {path}")
        return 0
    if list_them:
        described = list_templates()
        width = max(map(len, described), default=0)
        print_result("\n".join(f"{name:<{width}}  {text}" for name, text in described.items()))
        return 0
    path = write_template(path=output, force=force, **named)
    print_result(str(path))
    if (schema := write_schema(path.parent)) is not None:
        print_message(f"wrote {schema}, from which editors complete and validate specs")
    for line in profile_lines(path):
        print_message(line)
    print_message(f"wrote {path}; next: sitscad check {path}")
    return 0


@click.command(cls=Example, example="sitscad schema > sitscad.schema.json")
@click.option(
    "--of", "document", default="spec", show_default=True, metavar="spec|check|calibration|study",
    help="check: output of check --format json; calibration: calibration.json; study: a study's file.",
)
def schema(document: str) -> int:
    """Print the JSON Schema of the spec.

    Editors use it to complete and validate specs. --of prints the schema of a study's file, or of the JSON that `check`
    or `calibrate` writes.
    """
    schemas = {
        "spec": json_schema, "check": functools.partial(json_file, "check.schema"),
        "calibration": functools.partial(json_file, "calibration.schema"), "study": study_schema,
    }
    print_result(json.dumps(row_of(schemas, document, "--of")(), indent=1))
    return 0
