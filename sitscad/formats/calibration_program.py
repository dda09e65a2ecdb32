"""A program that turns counts into newtons by the map of `calibration_header`: what shows how it is called."""

from __future__ import annotations

PROGRAM = r"""/*
 * Reads counts of all coils, a line a reading, the tare first; prints the forces in newtons, a line a reading.
 *
 *     cc -std=c99 -O2 -o forces example.c -lm && ./forces < counts.txt
 *
 * Ends with 1 where a line cannot be read, with 2 where a coil gave no reading or its counts are beyond the map.
 */
#include <stdio.h>

#include "calibration.h"

static int line_of(uint32_t counts[SITSCAD_COILS])
{
    for (int coil = 0; coil < SITSCAD_COILS; ++coil) {
        unsigned long count;
        const int got = scanf("%lu", &count);
        if (got != 1)
            return got == EOF && coil == 0 ? EOF : 0;
        counts[coil] = (uint32_t)count;
    }
    return 1;
}

int main(void)
{
    struct sitscad_tare tare;
    uint32_t counts[SITSCAD_COILS];
    float forces[SITSCAD_AXES];
    int worst = 0, got;

    if (line_of(tare.counts) != 1)
        return 1;
    while ((got = line_of(counts)) == 1) {
        if (sitscad_forces((const uint32_t *)counts, &tare, forces) != SITSCAD_OK)
            worst = 2;
        for (int axis = 0; axis < SITSCAD_AXES; ++axis)
            printf(axis ? " %.6g" : "%.6g", (double)forces[axis]);
        printf("\n");
    }
    return got == EOF ? worst : 1;
}
"""
"""The program, in C99."""


def program() -> bytes:
    """The program's source, the same for every map."""
    return PROGRAM.encode("ascii")
