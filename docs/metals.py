"""Compare targets of all installed metals in one sensor.

Print conductivity, relative permeability and skin depth at the sensor's frequency. Also print the change of the first
coil's reading from rest to the required force, and the parallel resistance at rest.
"""

from pathlib import Path

import sitscad
from sitscad.kernels.electromagnetics.constants import skin_depth
from sitscad.spec import presets

spec = sitscad.load(Path("templates/bench_7mm.yaml"))
print(f"{'target':18} {'MS/m':>6} {'mu_r':>6} {'depth':>8} {'reading':>8} {'Rp':>7}")
found = []
for name in presets.names("conductor"):
    metal = presets.conductor(name)
    if metal.conductivity < 1e5:
        continue  # ferrite is no metal: it attracts the field
    estimates = sitscad.Design(spec.replace("target.material", name)).estimates
    rest = estimates.coils[0].states["rest"]
    depth = skin_depth(rest.frequency, metal.conductivity, metal.relative_permeability)
    found.append((estimates.signals[0].share, name, metal, depth, rest.parallel_resistance))
for share, name, metal, depth, resistance in sorted(found, key=lambda row: row[0]):
    print(
        f"{name:18} {metal.conductivity / 1e6:6.2f} {metal.relative_permeability:6.4g} {1e6 * depth:5.0f} um"
        f" {100 * share:6.2f} % {resistance / 1e3:4.2f} kohm"
    )
