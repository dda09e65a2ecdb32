"""Random specs of extreme proportions that the format allows: each is refused with findings or gets numbers.

    python tests/validation/extreme_specs.py [--specs N] [--first N] [--seconds S] [--gigabytes G]

loads, lays out, estimates and judges N specs drawn from seeds in one process, and prints those that end in anything
else: an exception, more CPU seconds than S, more memory than G.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import sitscad
from sitscad.checks.judging import RULES
from sitscad.checks.rules import rule_outcomes
from sitscad.estimates.design import Design

METALS = ["copper", "aluminium", "brass", "stainless-304", "stainless-17-4ph", "titanium-grade-5", "ferrite"]
SHAPES = ["circle"] * 12 + ["square", "hexagon", "racetrack"]


def extreme_spec(seed, shapes=SHAPES):
    """A spec as plain values: sizes of all that surrounds the coil over the whole range that the format allows."""
    pick = random.Random(seed)

    def between(low, high):
        return float(f"{math.exp(pick.uniform(math.log(low), math.log(high))):.3g}")

    def maybe(share, section, make):
        if pick.random() < share:
            document[section] = make()

    def plate(material):
        shape = pick.choice(["circle", "square", "rectangle"])
        size = [between(0.1, 500), between(0.1, 500)] if shape == "rectangle" else between(0.1, 500)
        return {"shape": shape, "size": size, "thickness": between(1e-3, 100), "material": material}

    def metal():
        odd = {
            "conductivity": f"{between(1e-3, 9e7)} S/m",
            "relative_permeability": pick.choice([1, 1, 2, 50, 5000]),
        }
        return pick.choice([*METALS, odd])

    def silicone():
        odd = {"shear_modulus": f"{between(100, 1e8)} Pa", "uncertainty": pick.choice([0, 0.3, 2])}
        return pick.choice(["ecoflex-00-30", "dragon-skin-10", odd])

    def mount():
        jaw = {"kind": "grasper-pad", "jaw": "generic-5mm"}
        return (jaw if pick.random() < 0.6 else {"kind": "bench-plate"}) | {"standoff": between(1e-3, 100)}

    def array(size):
        step = round(size * pick.uniform(1.25, 3), 2)
        return pick.choice([{"pattern": "line", "count": 2, "pitch": step}, {"pattern": "triangle", "pitch": step}])

    def readout():
        cable = {"length": between(1, 5000), "inductance": f"{between(1e-3, 1e6)} nH",
                 "capacitance": f"{between(1e-3, 1e6)} pF", "resistance": f"{between(1e-3, 1e3)} ohm"}
        result = {"capacitance": f"{between(1, 1e6)} pF", "scan_rate": f"{between(0.01, 1e6)} Hz", "cable": cable,
                 "capacitor_at": "coil"}
        return {key: value for key, value in result.items() if pick.random() < 0.5}

    shape = pick.choice(shapes)
    turns, width, spacing = pick.choice([1, 2, 3, 5]), between(0.03, 1), between(0.03, 1)
    across = round(2 * (width + spacing) * turns + between(0.3, 20) + width, 2)
    size = [round(across * pick.uniform(1.2, 4), 2), across] if shape == "racetrack" else across
    coil = {"shape": shape, "outer_diameter": size, "turns": turns, "layers": pick.choice([1, 2, 2]),
            "trace_width": width, "trace_spacing": spacing}
    document = {"sitscad": 1, "name": "extreme", "coil": coil}
    maybe(0.2, "array", lambda: array(max(size) if isinstance(size, list) else size))
    maybe(0.9, "target", lambda: plate(metal()))
    maybe(0.8, "elastomer", lambda: plate(silicone()))
    maybe(0.3, "encapsulation", lambda: {"thickness": between(1e-3, 100)})
    maybe(0.6, "mount", mount)
    maybe(0.3, "shield", lambda: {"material": pick.choice(["copper", "ferrite"]), "thickness": between(1e-3, 100),
                                  "gap": between(1e-3, 100)})
    maybe(0.7, "requirements", lambda: {"normal_force": f"{between(1e-3, 1e4)} N",
                                        "temperature": f"{pick.choice([-60, 20, 200])} degC"})
    maybe(0.4, "readout", readout)
    return document


def judged(document):
    """The rules that refuse a spec or complain of it, hints aside; JSON of its numbers must be finite or null."""
    try:
        spec = sitscad.load_text(json.dumps(document), "extreme.yaml")
    except sitscad.SpecError as error:
        return sorted({finding.rule for finding in error.findings})
    layout = sitscad.lay_out(spec)
    estimates = sitscad.estimate(layout)
    json.dumps(estimates.as_json("extreme.yaml"), allow_nan=False)
    subject = Design(spec, layout, estimates)
    return sorted({outcome.finding.rule for rule in RULES for outcome in rule_outcomes(rule, subject)[0]})


class TooLong(BaseException):
    """No exception that a program would catch."""


def _guarded(seconds, gigabytes):
    import resource
    import signal

    def stop(*_):
        raise TooLong

    signal.signal(signal.SIGVTALRM, stop)
    resource.setrlimit(resource.RLIMIT_AS, (int(gigabytes * 2**30),) * 2)
    return lambda on: signal.setitimer(signal.ITIMER_VIRTUAL, seconds if on else 0.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--specs", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--gigabytes", type=float, default=3.0)
    asked = parser.parse_args()
    clock = _guarded(asked.seconds, asked.gigabytes)
    bad, longest = 0, (0.0, 0)
    for seed in range(asked.first, asked.first + asked.specs):
        document, begun = extreme_spec(seed), time.process_time()
        try:
            clock(True)
            judged(document)
        except (Exception, TooLong) as error:
            bad += 1
            print(f"{seed}: {type(error).__name__} {error}: {json.dumps(document)}", flush=True)
        finally:
            clock(False)
        longest = max(longest, (time.process_time() - begun, seed))
    print(f"{asked.specs} specs, {bad} bad; the longest took {longest[0]:.1f} CPU seconds (seed {longest[1]})")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
