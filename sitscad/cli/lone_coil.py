"""`sitscad coil`: the figures of one planar coil from its dimensions, without a spec."""

from __future__ import annotations

import re
import sys

import click

from sitscad.apps.coil.drawn import DrawnCoil, drawn_coil
from sitscad.apps.coil.spiral import spiral
from sitscad.apps.coil.text import COIL_FORMATS, DRAWN_COIL_FORMATS
from sitscad.cli.measured import measured_options, print_comparison
from sitscad.cli.terminal import Example, coloured, print_message, print_result, row_of, write_output
from sitscad.estimates.states.at_frequency import FrequencyError
from sitscad.spec.drawn.copper import DrawnCoilError
from sitscad.spec.reading import SpecError


class Size(click.ParamType):
    """A length as in a spec, or two lengths with a comma between them: x and y of rectangles and racetracks."""

    name = "length"

    def convert(self, value: object, param: object, ctx: object) -> object:
        """Return the text of one length, or a list of two. A bare number is millimetres."""
        return _numbers(str(value))


class Counts(click.ParamType):
    """A number, or several with commas between them."""

    name = "number"

    def convert(self, value: object, param: object, ctx: object) -> object:
        """Return a number or a list of numbers. Other text is returned unchanged, and the spec's check refuses it."""
        return _numbers(str(value))


def _numbers(text: str) -> object:
    parts: list[object] = []
    for part in text.split(","):
        try:
            parts.append(int(part) if part.strip().isdigit() else float(part))
        except ValueError:
            parts.append(part.strip())
    return parts if len(parts) > 1 else parts[0]


MISSING = re.compile(r"\bcoil has no (\w+)")
"""Pattern of the message for a missing key of section ``coil``. The command names the option instead."""

OPTION = re.compile(r"\b(?:coil|fpc)\.(\w+)")
"""Pattern of a spec key in a message. The option of the same name sets this key."""


@click.command(cls=Example,
               example="sitscad coil --outer-diameter 8 --turns 14 --trace-width 100um --trace-spacing 100um --at 5MHz")
@click.argument("file", required=False, type=click.Path(dir_okay=False))
@click.option("--net", default="", metavar="NAME", help="The coil's net on the board FILE.")
@click.option("--from", "start", default="", metavar="PAD", help="The pad at which the coil of FILE begins, like J1.1.")
@click.option("--to", "end", default="", metavar="PAD", help="The pad at which it ends.")
@click.option("--outer-diameter", type=Size(),
              help="Across the outer copper edges; rectangles and racetracks: x,y like 12,8.")
@click.option("--turns", type=Counts(), help="Turns on each layer, or one number for each layer: 8,7.")
@click.option("--inner-diameter", type=Size(),
              help="Across the inner copper edges, in place of turns, trace width or trace spacing.")
@click.option("--trace-width", type=Size(), help="Width of the track.")
@click.option("--trace-spacing", type=Size(), help="Gap between turns.")
@click.option("--shape", metavar="NAME", help="circle, square, rectangle, hexagon, octagon or racetrack.  [default: "
                                                "circle]")
@click.option("--layers", type=Counts(),
              help="Number of copper layers in series, or their numbers from the top: 1,3.  [default: 1]")
@click.option("--stackup", metavar="NAME",
              help="Stack-up of the board, like flex-2l-30um (default: the usual one for so many layers).")
@click.option("--at", "frequencies", multiple=True, metavar="FREQUENCY", default=("1MHz",), show_default=True,
              help="Frequency of L, R, Q and Rp, like 5MHz; can be repeated.")
@click.option("--temperature", type=click.FloatRange(-60, 200), default=20.0, show_default=True, metavar="DEGC",
              help="Temperature of the copper.")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json")
@click.option("--svg", type=click.Path(dir_okay=False), help="Write a picture of the coil to this file.")
@click.option("--kicad-mod", type=click.Path(dir_okay=False), help="Write the coil as a KiCad footprint to this file.")
@measured_options
def coil(
    file: str | None, net: str, start: str, end: str, stackup: str | None, frequencies: tuple[str, ...],
    temperature: float, format_name: str, svg: str | None, kicad_mod: str | None, measured: str | None,
    meter_error: float, overlay: str | None, **section: object,
) -> int:
    """Print inductance, resistance and quality factor of one planar coil.

    The coil is given by its dimensions, or it is drawn in FILE, a KiCad board (.kicad_pcb) or footprint (.kicad_mod).
    No spec is needed. A bare number is a length in millimetres; units may be written (100um, 4mil, 8mm). The figures
    hold for the coil without metal near it, each with its error.

    \b
    By dimensions, without leads:
      sitscad coil --outer-diameter 8 --turns 14 --trace-width 100um
                   --trace-spacing 100um --layers 2
    From a drawing, from terminal to terminal:
      sitscad coil board.kicad_pcb --net COIL
      sitscad coil board.kicad_pcb --from J1.1 --to J1.2
      sitscad coil footprint.kicad_mod --stackup flex-2l-30um
    Beside a measurement, with the likeliest cause of a difference:
      sitscad coil --outer-diameter 8 ... --measured sweep.s1p

    \b
    Figures:
      L, R           Inductance and resistance in series at the frequency.
      Q              Quality factor, 2 pi f L / R.
      Rp             Parallel resistance of a tank that resonates at the
                     frequency, R (1 + Q^2).
      on an LCR      Reading of a meter. The coil's own capacitance lies
      meter          across the coil.
      self-resonance Frequency at which the coil resonates with its own
                     capacitance. Pads, leads and a fixture lower it.

    Exit code: 0 the figures are printed, 2 there is no such coil.
    """  # noqa: D301 - click needs the control character itself
    dimensions = {key: value for key, value in section.items() if value is not None}
    if overlay and not measured:
        raise click.UsageError("--overlay goes with --measured DATA")
    if file is not None:
        if dimensions or kicad_mod:
            options = [*dimensions, *(["kicad_mod"] if kicad_mod else [])]
            names = ", ".join("--" + name.replace("_", "-") for name in options)
            raise click.UsageError(f"{names} cannot change the coil that is drawn in {file}")
        drawn = _drawn(file, net, start, end, stackup, frequencies, temperature)
        if drawn is None:
            return 2
        if measured:
            return print_comparison(drawn, measured, None, meter_error, format_name, overlay)
        print_result(row_of(DRAWN_COIL_FORMATS, format_name, "--format")(drawn, coloured(sys.stdout)))
        _write({} if svg is None else {svg: drawn.picture()})
        return 0
    if net or start or end:
        raise click.UsageError("--net, --from and --to go with a FILE: sitscad coil board.kicad_pcb --net COIL")
    if "outer_diameter" not in dimensions:
        raise click.UsageError("give the coil's dimensions (--outer-diameter 8 --turns 14 ...), or a FILE in which it "
                               "is drawn")
    show = row_of(COIL_FORMATS, format_name, "--format")
    try:
        result = spiral({"shape": "circle", "layers": 1, **dimensions}, stackup, frequencies, temperature)
        renderers = (svg, result.picture), (kicad_mod, result.footprint)
        files = {path: draw() for path, draw in renderers if path is not None}
    except SpecError as error:
        for finding in error.findings:
            print_message(_with_options(finding.advised_message))
        return 2
    except FrequencyError as error:
        raise click.BadParameter(str(error), param_hint="--at") from error
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="--kicad-mod") from error
    if measured:
        _write(files)
        return print_comparison(result, measured, None, meter_error, format_name, overlay)
    print_result(show(result, coloured(sys.stdout)))
    _write(files)
    return 0


def _drawn(
    file: str, net: str, start: str, end: str, stackup: str | None, frequencies: tuple[str, ...], temperature: float
) -> DrawnCoil | None:
    """Return the coil that is drawn in a file. None if there is none; a message then gives the reason."""
    if bool(start) != bool(end):
        raise click.UsageError("--from and --to go together")
    try:
        return drawn_coil(file, net=net, start=start, end=end, stackup=stackup or "", frequency=list(frequencies),
                          temperature=temperature)
    except DrawnCoilError as error:
        print_message(f"{file}: {error}" if not str(error).startswith(file) else str(error))
        return None
    except FrequencyError as error:
        raise click.BadParameter(str(error), param_hint="--at") from error


def _write(files: dict[str, str]) -> None:
    for path, text in files.items():
        write_output(path, text.encode("utf-8"))
        print_message(f"wrote {path}")


def _with_options(message: str) -> str:
    """Return the message of a spec's finding with the names of the options that give its keys."""
    if missing := MISSING.search(message):
        name = missing[1].replace("_", "-")
        return f"--{name} is missing: give --{name}, or --inner-diameter with all other dimensions"
    return OPTION.sub(lambda key: "--" + key[1].replace("_", "-"), message)
