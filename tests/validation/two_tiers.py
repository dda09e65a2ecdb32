"""Do the two tiers of the fit ever disagree: figures alone against the solids, over random sensors in random jaws.

Run it as a script: ``python tests/validation/two_tiers.py 300`` (two seconds of processor time a sensor). What both
judge is whether the closed pair passes its port nominally, and whether the mount carries what is pressed on. They
disagree where one says yes and the other no, the radius is farther from the port's than meshes may be off (6 um), and
the share that is carried farther from nine tenths than 1 % (a face is looked for 5 um below itself); the solids may
find more, which is counted apart.
"""

from __future__ import annotations

import sys
from collections import Counter
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

HERE = Path(__file__).parent
CHORD_ERROR, SHARE_ERROR = 6e-6, 0.01


def random_sensor(seed: int):
    """The sensor of a seed, as the tests have it."""
    sys.path.insert(0, str(HERE.parent / "samples"))
    place = HERE.parent / "parts" / "test_proof.py"
    spec = spec_from_file_location("test_proof", place)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.random_sensor(seed)


def compared(seed: int) -> tuple[str, float, tuple[str, ...]]:
    """How the tiers compare: ``fits``, ``does not fit``, ``near the port`` or ``DISAGREE``; by how much (m) their radii
    differ; and what else the solids found.
    """
    from sitscad.assembly.places.fit import closed_section
    from sitscad.assembly.places.stack import LEAST_PRESSED_SHARE, support
    from sitscad.assembly.solids.clash import support_areas
    from sitscad.assembly.solids.proof import PORT, measure_solids
    from sitscad.assembly.solids.solid import PartsError
    from sitscad.assembly.solids.whole import whole

    layout = random_sensor(seed)
    try:
        pieces = whole(layout)
        plane, proof = closed_section(layout), measure_solids(layout, pieces)
    except PartsError as error:
        return f"cannot be made: {str(error)[:60]}", 0.0, ()
    passes = not any(fault.what == PORT for fault in proof.faults)
    apart, more = proof.radius - plane.radius, tuple(f.what for f in proof.faults if f.what != PORT)
    held, (measured, _) = support(layout), support_areas(layout, pieces)
    near = abs(held.share - LEAST_PRESSED_SHARE) <= SHARE_ERROR
    if abs(measured.value / held.pressed - held.share) > SHARE_ERROR or (
        not near and measured.is_kept != (held.share >= LEAST_PRESSED_SHARE)
    ):
        return "DISAGREE", apart, ("support",)
    if abs(plane.radius - plane.port_radius) <= CHORD_ERROR:
        return "near the port", apart, more
    if passes != plane.fits:
        return "DISAGREE", apart, more
    return ("fits" if passes else "does not fit"), apart, more


def main(count: int, first: int = 0) -> int:
    """Print each sensor that is out of the way, and a sum; the number of disagreements."""
    verdicts: Counter[str] = Counter()
    farthest, added = (0.0, -1), 0
    for seed in range(first, first + count):
        verdict, apart, more = compared(seed)
        verdicts[verdict] += 1
        farthest = max(farthest, (abs(apart), seed))
        added += bool(more)
        if verdict == "DISAGREE" or abs(apart) > CHORD_ERROR or more:
            print(f"seed {seed}: {verdict}, radii {apart * 1e6:+.2f} um apart {' '.join(more)}", flush=True)
        if (seed + 1 - first) % 25 == 0:
            print(f"after {seed + 1 - first}: {dict(verdicts)}", flush=True)
    print(f"{dict(verdicts)}; radii at most {farthest[0] * 1e6:.2f} um apart (seed {farthest[1]}); more found: {added}")
    return verdicts["DISAGREE"]


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])) > 0)
