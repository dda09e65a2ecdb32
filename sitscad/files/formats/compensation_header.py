"""Compensation of forces by temperature as a C99 header beside a calibration map's header."""

from __future__ import annotations

from collections.abc import Sequence

from sitscad.calibration.inverse_map import COMPENSATION_PASSES
from sitscad.estimates.performance.compensation import KELVIN, REFERENCE_TEMPERATURE, DriftCoefficients
from sitscad.files.formats.calibration_header import array_of, float_texts, of_cell
from sitscad.files.writer import comment_text


def compensation_header(drifts: DriftCoefficients, remarks: Sequence[str] = (), cell: int | None = None) -> bytes:
    """Return the C header ``temperature.h``. `cell` is as in `calibration_header.header`."""
    lines = [
        "#ifndef SITSCAD_TEMPERATURE_H", "#define SITSCAD_TEMPERATURE_H", "", '#include "calibration.h"', "",
        "#define SITSCAD_NO_TEMPERATURE 3 /* no valid temperature change: the forces are not compensated */",
        f"#define SITSCAD_WARMEST {drifts.largest_change:.6e}f /* largest change of temperature since the tare, K */",
        *_calibrated_range(drifts),
        f"#define SITSCAD_STIFFENING {drifts.stiffening:.6e}f /* of the pad, per K */",
        f"#define SITSCAD_LOAD {drifts.load:.6e}f /* normal force (N) of sitscad_drift_loaded */", "",
        "/* Relative change of the counts per K: at rest, and what is added under that force. */",
        *array_of("float", "sitscad_drift", "[SITSCAD_COILS]", float_texts(drifts.at_rest)),
        *array_of("float", "sitscad_drift_loaded", "[SITSCAD_COILS]", float_texts(drifts.loaded - drifts.at_rest)), "",
        *_thermometer(drifts), *COMPENSATED, "", "#endif", ""]
    about = "Forces compensated by the temperature change since the tare."
    origin = ("The coefficients are those of the design; a unit's own are better (docs/calibration.md)."
              if drifts.calibrated is None else "The coefficients were measured on this unit: take its tare between "
              "SITSCAD_COLDEST and SITSCAD_HOTTEST.")
    comment = ["/*", *(f" * {comment_text(each)}" for each in (about, *remarks, origin)), " */"]
    return "\n".join([*comment, of_cell("\n".join(lines), cell)]).encode("ascii", "replace")


def _calibrated_range(drifts: DriftCoefficients) -> list[str]:
    """Return C definitions of the temperatures between which the coefficients were measured. Empty if they were not."""
    if drifts.calibrated is None:
        return []
    low, high = drifts.calibrated
    return [f"#define SITSCAD_COLDEST {low:.6e}f /* lowest temperature of the calibration, degC */",
            f"#define SITSCAD_HOTTEST {high:.6e}f /* highest temperature of the calibration, degC */"]


def _thermometer(drifts: DriftCoefficients) -> list[str]:
    """Return the C function that computes a temperature or its change. Empty for a digital sensor."""
    if drifts.reference is not None:
        return [
            f"#define SITSCAD_BY_REFERENCE {drifts.reference:.6e}f /* relative change of its counts per K */", "",
            "/* Temperature change (K) since the tare, by the counts of the reference coil; NAN without a reading. */",
            "static inline float sitscad_warming(uint32_t counts, uint32_t rest)",
            "{",
            "    if (counts == 0u || rest == 0u)",
            "        return NAN;",
            "    return (float)((int32_t)counts - (int32_t)rest) / (float)rest / (SITSCAD_BY_REFERENCE);",
            "}", ""]
    part = drifts.thermistor
    if part is None or part.resistance is None or part.b is None:
        return []
    return [
        f"/* Temperature (degC) of the {part.product} by its resistance (ohm); NAN if open or shorted. */",
        "static inline float sitscad_celsius(float ohms)",
        "{",
        f"    if (!(ohms > {1e-3 * part.resistance:.6e}f && ohms < {1e3 * part.resistance:.6e}f))",
        "        return NAN;",
        f"    return 1.0f / ({1.0 / REFERENCE_TEMPERATURE:.8e}f + logf(ohms / {part.resistance:.6e}f) / {part.b:.6e}f) "
        f"- {KELVIN}f;",
        "}", ""]


COMPENSATED = (
    "/*",
    " * Forces at counts after a tare, compensated for `kelvin`, the temperature change since the tare. SITSCAD_OK, or",
    " * what is wrong. SITSCAD_NO_TEMPERATURE if `kelvin` is NAN or beyond SITSCAD_WARMEST: the forces are then those",
    " * of sitscad_forces, also at the end of the map.",
    " */",
    "static inline int sitscad_compensated(const uint32_t counts[SITSCAD_COILS], const struct sitscad_tare *tare,",
    "                                      float kelvin, float forces[SITSCAD_AXES])",
    "{",
    "    int result = sitscad_forces(counts, tare, forces);",
    "",
    "    if (result == SITSCAD_NO_READING)",
    "        return result;",
    "    if (!(kelvin >= -SITSCAD_WARMEST && kelvin <= SITSCAD_WARMEST))",
    "        return SITSCAD_NO_TEMPERATURE;",
    "    /* the drift depends on the force, which each pass knows better */",
    f"    for (int pass = 0; pass < {COMPENSATION_PASSES}; ++pass) {{",
    "        const float load = forces[SITSCAD_NORMAL] / SITSCAD_LOAD;",
    "        const float part = load < 0.0f ? 0.0f : load > 1.0f ? 1.0f : load;",
    "        uint32_t cold[SITSCAD_COILS];",
    "",
    "        for (int coil = 0; coil < SITSCAD_COILS; ++coil) {",
    "            const float drift = kelvin * (sitscad_drift[coil] + part * sitscad_drift_loaded[coil]);",
    "            cold[coil] = (uint32_t)((int32_t)counts[coil] - (int32_t)(drift * (float)counts[coil]));",
    "        }",
    "        result = sitscad_forces((const uint32_t *)cold, tare, forces);",
    "        for (int axis = 0; axis < SITSCAD_AXES; ++axis)",
    "            forces[axis] *= 1.0f + SITSCAD_STIFFENING * kelvin;",
    "    }",
    "    return result;",
    "}",
)
"""C function that subtracts the drift from the counts and multiplies the forces by the change of the modulus."""
