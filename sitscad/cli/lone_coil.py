"""`sitscad coil`: the figures of one planar coil from its dimensions, without a spec."""

from __future__ import annotations

import re
import sys

import click

from sitscad.cli.terminal import Example, coloured, print_result, row_of, say


class Size(click.ParamType):
    """A length as a spec has it, or two with a comma between them: of rectangles and racetracks, x and y."""

    name = "length"

    def convert(self, value: object, param: object, ctx: object) -> object:
        """Return the text of one length, or a list of two. A bare number is millimetres."""
        return _plain(str(value))


class Counts(click.ParamType):
    """A number, or several with commas between them."""

    name = "number"

    def convert(self, value: object, param: object, ctx: object) -> object:
        """Return a number, or a list of numbers; what is no number stays a text, and is refused with the spec."""
        return _plain(str(value))


def _plain(text: str) -> object:
    parts: list[object] = []
    for part in text.split(","):
        try:
            parts.append(int(part) if part.strip().isdigit() else float(part))
        except ValueError:
            parts.append(part.strip())
    return parts if len(parts) > 1 else parts[0]


OPTION = re.compile(r"\b(?:coil|fpc)\.(\w+)")
"""A key of a spec in a message: the option of this name gives its value."""


@click.command(cls=Example,
               example="sitscad coil --outer-diameter 8 --turns 14 --trace-width 100um --trace-spacing 100um --at 5MHz")
@click.option("--outer-diameter", type=Size(), required=True,
              help="Across the outer copper edges; of a rectangle or racetrack x,y like 12,8.")
@click.option("--turns", type=Counts(), help="Turns on each layer, or one number for each layer: 8,7.")
@click.option("--inner-diameter", type=Size(),
              help="Across the inner copper edges, in place of turns, trace width or trace spacing.")
@click.option("--trace-width", type=Size(), help="Width of the track.")
@click.option("--trace-spacing", type=Size(), help="Gap between turns.")
@click.option("--shape", default="circle", show_default=True, metavar="NAME",
              help="circle, square, rectangle, hexagon, octagon or racetrack.")
@click.option("--layers", type=Counts(), default="1", show_default=True,
              help="Number of copper layers in series, or their numbers from the top: 1,3.")
@click.option("--stackup", metavar="NAME",
              help="Stack-up of the board, like flex-2l-30um (default: the usual one for so many layers).")
@click.option("--at", "frequencies", multiple=True, metavar="FREQUENCY", default=("1MHz",), show_default=True,
              help="Frequency of L, R, Q and Rp, like 5MHz; can be repeated.")
@click.option("--temperature", type=click.FloatRange(-60, 200), default=20.0, show_default=True, metavar="DEGC",
              help="Temperature of the copper.")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json")
@click.option("--svg", type=click.Path(dir_okay=False), help="Write a picture of the coil to this file.")
@click.option("--kicad-mod", type=click.Path(dir_okay=False), help="Write the coil as a KiCad footprint to this file.")
def coil(
    stackup: str | None, frequencies: tuple[str, ...], temperature: float, format_name: str, svg: str | None,
    kicad_mod: str | None, **section: object,
) -> int:
    """Print inductance, resistance, quality factor and self-resonance of one planar coil.

    No spec is needed. A bare number is a length in millimetres; units may be written (100um, 4mil, 8mm). The figures
    are those of the winding without leads and without metal near it. Each stands with its error, and Mohan's closed
    formula stands beside the inductance as a check by others.

    \b
    Figures:
      L, R           inductance and resistance in series at the frequency.
      Q              2 pi f L / R.
      Rp             parallel resistance of a tank that resonates at the
                     frequency, R (1 + Q^2).
      on an LCR      what a meter reads: the coil's own capacitance lies
      meter          across it.
      self-resonance frequency at which the coil resonates with its own
                     capacitance. Pads, leads and a fixture lower it.

    Exit code: 0 the figures are printed, 2 there is no such coil.
    """  # noqa: D301 - click asks for the control character itself
    from sitscad.apps.coil.spiral import spiral
    from sitscad.apps.coil.text import COIL_FORMATS
    from sitscad.estimates.states.at_frequency import FrequencyError
    from sitscad.spec.reading import SpecError

    show = row_of(COIL_FORMATS, format_name, "--format")
    try:
        found = spiral({key: value for key, value in section.items() if value is not None}, stackup, frequencies,
                       temperature)
        files = {svg: found.picture, kicad_mod: found.footprint}
        drawn = {path: draw() for path, draw in files.items() if path is not None}
    except SpecError as error:
        for finding in error.findings:
            say(OPTION.sub(lambda key: "--" + key[1].replace("_", "-"), finding.advised_message))
        return 2
    except FrequencyError as error:
        raise click.BadParameter(str(error), param_hint="--at") from error
    print_result(show(found, coloured(sys.stdout)))
    if drawn:
        from sitscad.package.folder import write_file

        for path, text in drawn.items():
            write_file(path, text.encode("utf-8"))
            say(f"wrote {path}")
    return 0
