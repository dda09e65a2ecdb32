"""Hints for tanks that are too fast or too lossy: more turns or layers, or another capacitor, found by trying."""

from __future__ import annotations

from sitscad.remedy.fix import Fix, fail
from sitscad.remedy.moves import more_layers, more_turns
from sitscad.remedy.search import Left, broken_by, first_or_vain, named, untried, ways
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show

TOO_LOSSY = "SIT203"
"""The rule that a tank of too little parallel resistance breaks."""


def more_copper(spec: SensorSpec, factor: float, left: Left, sentence: str) -> str:
    """More turns or layers that mend a finding, found by trying those that grow the coil by that factor, in their place
    in a sentence; where the search ended before it found one, the first that was not tried.
    """
    families = [list(more_turns(spec, factor)), list(more_layers(spec, factor))]
    found = ways(families, left)
    if found:
        return sentence.format(f"{named(found)} mends it (it was tried)")
    if not any(families):
        return sentence.format("no more of either fit into this outline: a larger coil or a finer pitch")
    if left.is_cut_short:
        perhaps = untried((fix for fixes in families for fix in fixes), left)
        return sentence.format(f"{perhaps or 'more of them'}, a larger coil or a finer pitch")
    most = " and ".join(fixes[-1].words for fixes in families if fixes)
    broken = broken_by((fix for fixes in families for fix in fixes), left)
    vain = f"tried up to {most}: {fail(broken)}"
    return sentence.format(f"in this outline more of them do not mend it ({vain}); a larger coil or a finer pitch may")


def larger_capacitor(fixes: list[Fix], now: float, left: Left) -> str:
    """The first of some capacitors, smallest first, that mends a finding, in words, instead of the one of now (F);
    where the search ended before it found one, the first that was not tried.

    None is tried that is larger than one with too little parallel resistance: L / (R C) falls as C grows, for R falls
    by less than the square of the frequency.
    """
    else_does = "more turns or layers, or a larger coil; a larger capacitor alone does not do"
    return first_or_vain(_not_lossier(fixes, left), left, (f" instead of {show(now, 'F', 3)}", "more turns", else_does))


def _not_lossier(fixes: list[Fix], left: Left) -> list[Fix]:
    """Up to the first that is tried with too little parallel resistance; all where another comes first that mends."""
    for number, fix in enumerate(fixes, 1):
        broken = left(fix)
        if not broken:
            break
        if TOO_LOSSY in broken:
            return fixes[:number]
    return fixes
