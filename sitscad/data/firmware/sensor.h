/*
 * The sensor of this folder: set up, read, tested against its design, tared, in newtons.
 * What differs from sensor to sensor stands in sensor_config.h, the map to newtons in calibration.h; a sensor with
 * cells has a map for each of them, which cells.h includes.
 * C99; no heap, no delay, no library; floating point for the frequencies that are told and for newtons alone.
 */
#ifndef SENSOR_H
#define SENSOR_H

#include "ldc161x.h"
#include "sensor_config.h"

/* calibration.h of this one sensor beside this file goes before the package's, which is that of a drawing. */
#if defined(SENSOR_NO_CALIBRATION)
#elif defined(SENSOR_HAS_CELLS)
#include "cells.h"
#elif defined(__has_include)
#if __has_include("calibration.h")
#include "calibration.h"
#elif __has_include("../calibration/calibration.h")
#include "../calibration/calibration.h"
#endif
#else
#include "calibration.h"
#endif

#if defined(SITSCAD_COILS) && !defined(SENSOR_HAS_CELLS)
#if SITSCAD_COILS != SENSOR_COILS
#error "calibration.h is another sensor's: its number of coils is not SENSOR_COILS"
#endif
#endif

#ifdef SITSCAD_AXES
#define SENSOR_AXES SITSCAD_AXES /* of a cell */
#else
#define SENSOR_AXES 1 /* no map: sensor_cell_forces gives SENSOR_E_NO_MAP */
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* What is said of a coil's reading. All but the first and the last are faults: such counts make no force. */
enum {
    SENSOR_GOOD = 0,
    SENSOR_STALE,       /* older than a scan, or a sudden one that the next result has yet to confirm */
    SENSOR_UNDER_RANGE, /* the result is the smallest */
    SENSOR_OVER_RANGE,  /* the result is the largest */
    SENSOR_WATCHDOG,    /* the coil does not oscillate */
    SENSOR_OUT_OF_BAND, /* the frequency is farther from the design's than manufacture explains */
    SENSOR_AMPLITUDE    /* a warning: the oscillation is outside of 1.2 to 1.8 V */
};

enum {
    SENSOR_E_BUS = -1,      /* no answer on the bus */
    SENSOR_E_IDENTITY = -2, /* what answers is no LDC1612 or LDC1614 */
    SENSOR_E_SETTINGS = -3, /* a register does not read back as it was written */
    SENSOR_E_LOST = -4,     /* a converter had lost its settings and was set up again */
    SENSOR_E_NO_TARE = -5,  /* sensor_tare comes before forces */
    SENSOR_E_NO_MAP = -6    /* there is no calibration.h, or no such cell */
};

/* What the self-test says of a coil. */
enum {
    SENSOR_COIL_OK = 0,
    SENSOR_COIL_OPEN,          /* does not oscillate: open, or shorted from end to end */
    SENSOR_COIL_SHORT,         /* inductance below a fifth of the design's: most of it is shorted */
    SENSOR_COIL_TURNS_MISSING, /* inductance too low: a layer is missing or turns are shorted */
    SENSOR_COIL_EXCHANGED,     /* another coil of the design is wired here */
    SENSOR_COIL_OUT_OF_BAND,   /* inductance or capacitor too large, or over range */
    SENSOR_COIL_SILENT         /* the converter gives no result */
};

enum { SENSOR_BARE = 0, SENSOR_ASSEMBLED = 1 };

typedef struct {
    uint32_t counts[SENSOR_COILS];
    uint8_t status[SENSOR_COILS];
    float frequency_Hz[SENSOR_COILS];
} sensor_reading;

typedef struct {
    uint8_t state;                     /* which of the design's states the coils fit best: bare or assembled */
    uint8_t told_apart;                /* whether exchanged coils would be seen without touching them */
    uint8_t coil[SENSOR_COILS];        /* SENSOR_COIL_... */
    uint8_t amplitude[SENSOR_COILS];   /* 1: the oscillation is outside of 1.2 to 1.8 V */
    uint32_t counts[SENSOR_COILS];
    int16_t inductance[SENSOR_COILS];  /* by how many thousandths the inductance is off the design's */
} sensor_report;

typedef struct {
    const ldc161x_bus *bus;           /* SENSOR_BUSES of them */
    uint32_t counts[SENSOR_COILS];    /* the last that was believed; 0: none */
    uint32_t step[SENSOR_COILS];      /* how far that was from the one before */
    uint32_t result[SENSOR_COILS];    /* the last, believed or not; 0: none */
    uint32_t tare[SENSOR_COILS];
    uint8_t status[SENSOR_COILS];
    uint8_t behind[SENSOR_COILS];     /* how often another coil was read since */
    uint8_t alike[SENSOR_COILS];      /* results in a row that are the same to the last bit */
    uint8_t doubted[SENSOR_COILS];    /* whether `result` waits to be confirmed */
    uint8_t amplitude[SENSOR_COILS];  /* whether the oscillation of the last was outside of 1.2 to 1.8 V */
    uint8_t idle[SENSOR_CONVERTERS];  /* polls without anything new */
    uint8_t lost[SENSOR_CONVERTERS];  /* whether it has to be set up */
    uint8_t tares;                    /* readings in a row that the tare is the mean of; 0: there is none */
    uint8_t since[SENSOR_COILS];      /* results since the last of them */
    uint16_t restarts;                /* how often a converter had lost its settings */
} sensor;

/*
 * 0, or a negative SENSOR_E_... that sensor_text() puts in words. `buses` are all SENSOR_BUSES of them, a constant
 * array that lives as long as the sensor: `sensor_begin(&one, &buses)`.
 */
int sensor_begin(sensor *self, const ldc161x_bus (*buses)[SENSOR_BUSES]);

/*
 * The number of coils that are new; 0 where there is nothing new; negative on the bus, or where settings were lost.
 * A coil that is not new keeps its counts and is SENSOR_STALE once another was read twice since; where nothing is new
 * all are. A result that leaps by more than noise and motion explain counts as new once the next confirms it: a single
 * wrong value is never given out, and a true step comes one scan late.
 */
int sensor_poll(sensor *self, sensor_reading *reading);

/*
 * Each coil against the design; it polls until every coil has a result, a bad one twice. 0 is good; positive: so many
 * coils are not. A tare begins anew after it.
 */
int sensor_self_test(sensor *self, sensor_report *report);

/*
 * Takes counts without load. Called scan after scan it takes their mean (16 of them have a quarter of the noise): once
 * every coil is new, or nothing. Called again later than after two scans it begins anew. 0, or the number (from 1) of a
 * coil without a good reading: the old tare stays.
 */
int sensor_tare(sensor *self, const sensor_reading *reading);

/*
 * Forces on a cell (from 0, below SENSOR_CELLS; a sensor without cells is cell 0). 0; the number (from 1) of a coil of
 * this cell without a good reading, forces 0; SENSOR_COILS + 1 beyond what the map was made for, forces those at its
 * end; or negative. Moments, where the map has some, are newton metres.
 */
int sensor_cell_forces(const sensor *self, const sensor_reading *reading, int cell, float newtons[SENSOR_AXES]);

#ifndef SENSOR_HAS_CELLS
/* Forces of a sensor without cells: those of cell 0. */
int sensor_forces(const sensor *self, const sensor_reading *reading, float newtons[SENSOR_AXES]);
#endif

const char *sensor_text(int error);      /* what SENSOR_E_... says */
const char *sensor_coil_text(int coil);  /* what SENSOR_COIL_... says */
const char *sensor_coil_name(int index); /* the coil's name in the design, from 0 */

#ifdef __cplusplus
}
#endif

#endif
