"""`sitscad verify`: read packages back and compare their parts."""

from __future__ import annotations

import click

from sitscad.cli.terminal import PLUGIN, Example, print_result
from sitscad.package.verification import verify as verify_package


@click.command(cls=Example, example="sitscad verify outputs/grasper-4layer")
@click.argument("directory", type=click.Path())
@click.option("--rebuild", is_flag=True,
              help="Build it again from its spec and compare every byte, computed figures by value.")
@PLUGIN
def verify(directory: str, rebuild: bool) -> int:
    """Read a finished package back and compare its parts.

    Files are compared with the manifest, the nets of the copper with the intended nets, layers and holes with job file
    and netlist. The order archive is compared with the files beside it, and every board of a panel with the
    single board.
    A person who changes a file can also rewrite its hash: --rebuild detects this, too. It compares computed figures by
    value, because their last digits depend on the processor. It cannot check that the spec in the package is yours.
    Exit code: 0 equal, 1 something differs, 2 not a package, or unreadable.
    """
    result = verify_package(directory, rebuild)
    for difference in result.differences:
        print_result(difference)
    print_result(f"{'ok' if result.ok else 'differs'}: {', '.join(result.looked_at)}")
    return 0 if result.ok else 1
