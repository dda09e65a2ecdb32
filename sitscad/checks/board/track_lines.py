"""SIT101 to SIT103: the coil's tracks and gaps against what the fabricator makes, in coils and elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import islice

from sitscad.checks.board.fabrication import FABRICATOR, ROUNDING, house, source_of, um
from sitscad.checks.cases import Case
from sitscad.checks.rules import Complaint, Rule, Undecided, Verdict
from sitscad.design import Design
from sitscad.finding import Place, Severity
from sitscad.remedy.fix import Fix
from sitscad.remedy.moves import finer_fabricators, wider
from sitscad.remedy.search import Left, first_or_vain, first_that_mends

WIDEN = "widen tracks and gaps and wind fewer turns, or choose {finer}"
NO_FINER = "a finer fabricator (no installed profile is as fine)"
NAMED = 4
"""Finer fabricators that are named at most."""
WAIVER = "ask the fabricator for a waiver (no electrical test sees a short between turns)"


def trace_width(design: Design) -> Iterator[Verdict]:
    """The coil's track against the fabricator's smallest track."""
    yield from _too_fine(design, "trace_width", "tracks are {} wide", "wider")
    yield from _thicker_foil(design, "trace_width", "tracks")
    yield from _drawn_width(design)


def _too_fine(design: Design, field: str, asked: str, more: str) -> Iterator[Complaint]:
    """A figure of the coil, in words of which it is part, below the fabricator's smallest."""
    value, least = getattr(design.spec.coil, field), getattr(design.spec.fpc.rules, field)
    if value < least - ROUNDING:
        yield TOO_FINE.found(f"coil.{field}", value, least, "m",
                             hint=WIDEN.format(finer=_finer(list(finer_fabricators(design.spec)))),
                             source=source_of(design, field), advice=lambda left: _widened(design, left),
                             asked=asked.format(um(value)), house=house(design, field), more=more)


def _thicker_foil(design: Design, field: str, word: str, severity: Severity = Severity.ERROR) -> Iterator[Complaint]:
    """Foil thicker than every one that the fabricator gives lines for: what holds there is not known."""
    spec = design.spec
    rules, foil = spec.fpc.rules, spec.fpc.stackup.line_foil(spec.coil.layers)
    stated = rules.beyond.get(field)
    if stated is not None:
        yield THICKER_FOIL.found("fpc.rules", foil, stated, "m", severity=severity, source=source_of(design, field),
                                 house=house(design, field), word=word, field=field)


def _drawn_width(design: Design) -> Iterator[Complaint]:
    """Tracks drawn narrower than the fabricator makes, where the coil's own width is not the reason."""
    rules, coil = design.spec.fpc.rules, design.spec.coil
    for trace in design.layout.traces:
        if trace.width < min(rules.trace_width, coil.trace_width) - ROUNDING:
            yield DRAWN_TOO_FINE.found("fpc.rules", trace.width, rules.trace_width, "m",
                                       source=source_of(design, "trace_width"),
                                       place=Place(*trace.path.start, trace.layer, (trace.net,)), role=trace.role.value,
                                       net=trace.net, layer=trace.layer, house=house(design, "trace_width"))


def trace_spacing(design: Design) -> Iterator[Verdict]:
    """The asked spacing against the fabricator's smallest spacing."""
    yield from _too_fine(design, "trace_spacing", "turns stand {} apart", "more")
    yield from _thicker_foil(design, "trace_spacing", "spacings")


def loop_lines(design: Design) -> Iterator[Verdict]:
    """Track and spacing of the turns against the fabricator's own minimum for coils ("loop lines")."""
    coil, rules = design.spec.coil, design.spec.fpc.rules
    pairs = (("trace_width", "track", coil.trace_width, rules.coil_trace_width),
             ("trace_spacing", "spacing", coil.trace_spacing, rules.coil_trace_spacing))
    if all(smallest is None for *_, smallest in pairs):
        yield Undecided(f"{rules.name} states no minimum of its own for coils")
    copper = f" at {um(rules.coil_copper)} copper" if rules.coil_copper is not None else ""
    for field, word, value, smallest in pairs:
        if smallest is not None and value < smallest - ROUNDING:
            binds = rules.binds(f"coil_{field}")
            why = "" if binds else f"this only warns: {_not_binding(design)}"
            yield FINE_COIL.found(f"coil.{field}", value, smallest, "m", source=source_of(design, f"coil_{field}"),
                                  advice=partial(_waived_or_widened if binds else _hardly_widened, design),
                                  is_grave=binds, word=word, house=house(design, f"coil_{field}"), copper=copper,
                                  why=why)
    unknown = next((f for f in ("coil_trace_width", "coil_trace_spacing") if f in rules.beyond), None)
    if unknown is not None:
        severity = Severity.ERROR if rules.binds(unknown) else Severity.WARNING
        yield from _thicker_foil(design, unknown, "coiled tracks", severity)


def _widened(design: Design, left: Left) -> str:
    """Tracks and gaps as wide as all binding rules ask, together, with as many turns as then do: found by trying."""
    rules = design.spec.fpc.rules
    width, spacing = (
        max(getattr(rules, field), (getattr(rules, f"coil_{field}") or 0.0) if rules.binds(f"coil_{field}") else 0.0)
        for field in ("trace_width", "trace_spacing")
    )
    wide, houses = list(wider(design.spec, width, spacing)), list(finer_fabricators(design.spec))
    is_wide = first_that_mends(wide, left) is not None
    found = None if is_wide else first_that_mends(houses[:NAMED], left)
    finer = f"{found.words} (it was tried)" if found is not None else f"choose {_finer(houses)}"
    return first_or_vain(wide, left, ("", finer, f"{finer}, or a larger coil with wider tracks and gaps"))


def _finer(houses: Sequence[Fix]) -> str:
    """The finer fabricators in words: their figures allow it."""
    if not houses:
        return NO_FINER
    return f"a finer fabricator by fpc.rules ({', '.join(fix.edits[0].new for fix in houses[:NAMED])})"


def _hardly_widened(design: Design, left: Left) -> str:
    """Tracks and gaps as a rule asks that only warns, where the coil has room for that with all its turns."""
    rules = design.spec.fpc.rules
    widths = (rules.coil_trace_width or 0.0, rules.coil_trace_spacing or 0.0)
    fixes = islice(wider(design.spec, *widths), 1)
    found = first_that_mends((fix for fix in fixes if fix.spec.coil.turns == design.spec.coil.turns), left)
    return "" if found is None else f"{found.words} takes no turn (it was tried); or {WAIVER}"


def _waived_or_widened(design: Design, left: Left) -> str:
    widened = _widened(design, left)
    return f"{WAIVER}, or {widened}" if widened else ""


def _not_binding(design: Design) -> str:
    """Why a fabricator's minimum for coils only warns: not every house has it."""
    rules = design.spec.fpc.rules
    if rules.unbound:
        return "it comes from the profile that yours is based on, which does not make it binding"
    holder = rules.holders.get("coil_rule_binding", rules.name)
    return f"{holder} does not make it binding (coil_rule_binding: no)"


TOO_FINE = Case("{asked}; {house} makes {limit:m} and {more}",)

THICKER_FOIL = Case(
    "{house} gives no figure for {word} in {measured:m} copper; the thickest stated is {limit:m}",
    hint="ask the fabricator, and write {field} in fpc.rules; or choose thinner copper",
)

DRAWN_TOO_FINE = Case(
    "the {role} of {net} on layer {layer} is drawn {measured:m} wide; {house} makes {limit:m} and wider",
)

FINE_COIL = Case(
    "{word} in the coil is {measured:m}; for coiled tracks {house} asks {limit:m}{copper}", detail="{why}",
    hint="ask the fabricator for a waiver (no electrical test sees a short between turns), or widen tracks and gaps, "
    "which takes turns and lowers L and Rp (see SIT201 and SIT203)", severity=Severity.WARNING, grave=Severity.ERROR,
)


TRACK_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT101", "trace-width", Severity.ERROR,
        "The coil's track, and every other one, is at least as wide as the fabricator makes.",
        "A narrower track is over-etched: it breaks, or its resistance is anybody's guess.",
        "Widen coil.trace_width (fewer turns fit), or name a finer fabricator in fpc.rules.", FABRICATOR,
        apply=trace_width,
    ),
    Rule(
        "SIT102", "trace-spacing", Severity.ERROR,
        "Neighbouring turns stand at least as far apart as the fabricator makes.",
        "Turns that touch are one net: no electrical test and no netlist sees the short, and the inductance is gone.",
        "Widen coil.trace_spacing (fewer turns fit), or name a finer fabricator in fpc.rules.", FABRICATOR,
        apply=trace_spacing,
    ),
    Rule(
        "SIT103", "coil-trace", Severity.ERROR,
        "Coiled tracks keep the fabricator's own minimum for coils (loop lines), often twice the ordinary one.",
        "Several flex houses list a larger minimum for coils, because their test cannot see a short between turns; a "
        "coil at the ordinary minimum is queried or refused. An error where the rule binds, else a warning.",
        "Ask for a waiver before ordering, widen the pitch, or name another fabricator.",
        "hkgalaxy and jselectronic: loop lines 6/6 mil at 18 um copper, 8/8 mil at 35 um; JLCPCB 2023-09-05: coils "
        "0.254 mm, limit 0.15 mm", apply=loop_lines,
    ),
)
