/*
 * The driver of the sensor in this folder: set-up, readings, self-test against the design, tare, and forces in newtons.
 * sensor_config.h has the settings of this sensor. calibration.h has its map to newtons. A sensor with cells has a map
 * for each cell, which cells.h includes. temperature.h has the drift that is taken off, if the design measures its
 * temperature (SENSOR_COMPENSATED).
 * C99 without heap, delays and libraries. Only frequencies and newtons are floating-point numbers.
 */
#ifndef SENSOR_H
#define SENSOR_H

#include "ldc161x.h"
#include "sensor_config.h"

/* calibration.h beside this file belongs to this unit. It takes precedence over the package's map of the drawing. */
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

#if defined(SENSOR_COMPENSATED) || defined(SENSOR_THERMOMETER)
#include <math.h>
#endif
#if defined(SENSOR_COMPENSATED) && defined(SITSCAD_COILS)
#if !defined(__has_include)
#include "temperature.h"
#elif __has_include("temperature.h")
#include "temperature.h"
#elif __has_include("../calibration/temperature.h")
#include "../calibration/temperature.h"
#endif
#endif

#if defined(SITSCAD_COILS) && !defined(SENSOR_HAS_CELLS)
#if SITSCAD_COILS != SENSOR_CELL_COILS
#error "calibration.h is another sensor's: its number of coils is not SENSOR_CELL_COILS"
#endif
#endif

#ifdef SITSCAD_AXES
#define SENSOR_AXES SITSCAD_AXES /* of one cell */
#else
#define SENSOR_AXES 1 /* no map: sensor_cell_forces returns SENSOR_E_NO_MAP */
#endif

#define SENSOR_BEYOND (SENSOR_COILS + 1)         /* the forces are those at the end of the map's range */
#define SENSOR_NO_TEMPERATURE (SENSOR_COILS + 2) /* no valid temperature: the forces are not compensated */

#ifdef __cplusplus
extern "C" {
#endif

/* Status of a coil's reading. All but the first and the last are faults: counts with a fault give no force. */
enum {
    SENSOR_GOOD = 0,
    SENSOR_STALE,       /* older than a scan, or a jump that the next result must confirm */
    SENSOR_UNDER_RANGE, /* the smallest possible result */
    SENSOR_OVER_RANGE,  /* the largest possible result */
    SENSOR_WATCHDOG,    /* the coil does not oscillate */
    SENSOR_OUT_OF_BAND, /* farther from the design's frequency than tolerances explain */
    SENSOR_AMPLITUDE    /* a warning: the amplitude is outside 1.2 to 1.8 V */
};

enum {
    SENSOR_E_BUS = -1,      /* no answer on the bus */
    SENSOR_E_IDENTITY = -2, /* no LDC1612 or LDC1614 answers */
    SENSOR_E_SETTINGS = -3, /* a register does not hold the written value */
    SENSOR_E_LOST = -4,     /* a converter had lost its settings and was set up again */
    SENSOR_E_NO_TARE = -5,  /* call sensor_tare first */
    SENSOR_E_NO_MAP = -6    /* no calibration.h, or no cell of this number */
};

/* Result of the self-test for a coil. */
enum {
    SENSOR_COIL_OK = 0,
    SENSOR_COIL_OPEN,          /* does not oscillate: open, or shorted from end to end */
    SENSOR_COIL_SHORT,         /* inductance below a fifth of the design's: most turns are shorted */
    SENSOR_COIL_TURNS_MISSING, /* inductance too low: a layer is missing or turns are shorted */
    SENSOR_COIL_EXCHANGED,     /* wired in place of another coil of the design */
    SENSOR_COIL_OUT_OF_BAND,   /* inductance or capacitor too large, or over range */
    SENSOR_COIL_SILENT         /* the converter gives no result */
};

enum { SENSOR_BARE = 0, SENSOR_ASSEMBLED = 1 };

typedef struct {
    uint32_t counts[SENSOR_COILS];
    uint8_t status[SENSOR_COILS];
    float frequency_Hz[SENSOR_COILS];
#ifdef SENSOR_THERMOMETER
    float celsius; /* temperature by the sensor of sensor_set_thermometer; NAN if it is not valid */
#endif
} sensor_reading;

typedef struct {
    uint8_t state;                     /* the state of the design that fits best: bare or assembled */
    uint8_t told_apart;                /* 1: the test detects exchanged coils without a touch */
    uint8_t coil[SENSOR_COILS];        /* SENSOR_COIL_... */
    uint8_t amplitude[SENSOR_COILS];   /* 1: the amplitude is outside 1.2 to 1.8 V */
    uint32_t counts[SENSOR_COILS];
    int16_t inductance[SENSOR_COILS];  /* deviation of the inductance from the design, in thousandths */
} sensor_report;

typedef struct {
    const ldc161x_bus *bus;           /* an array of SENSOR_BUSES buses */
    uint32_t counts[SENSOR_COILS];    /* the last accepted result; 0: none */
    uint32_t step[SENSOR_COILS];      /* its distance from the accepted result before */
    uint32_t result[SENSOR_COILS];    /* the last result, accepted or not; 0: none */
    uint32_t tare[SENSOR_COILS];
    uint8_t status[SENSOR_COILS];
    uint8_t behind[SENSOR_COILS];     /* readings of another coil since then */
    uint8_t alike[SENSOR_COILS];      /* number of equal results in a row */
    uint8_t doubted[SENSOR_COILS];    /* 1: the next result must confirm `result` */
    uint8_t amplitude[SENSOR_COILS];  /* 1: its amplitude was outside 1.2 to 1.8 V */
    uint8_t idle[SENSOR_CONVERTERS];  /* polls without a new result */
    uint8_t lost[SENSOR_CONVERTERS];  /* 1: the converter must be set up */
    uint8_t tares;                    /* readings in the mean of the tare; 0: no tare */
    uint8_t since[SENSOR_COILS];      /* results since the last reading of the tare */
    uint16_t restarts;                /* number of times that a converter lost its settings */
#ifdef SENSOR_REFERENCE
    uint8_t is_tare_faulty;           /* 1: the reference coil had a fault in a reading of the tare */
#endif
#ifdef SENSOR_THERMOMETER
    float (*thermometer)(const void *context); /* returns the temperature (degC), or NAN; NULL: no sensor */
    const void *context;
    float celsius;                    /* the last temperature */
    float tare_celsius;               /* the temperature of the tare */
    uint16_t until_celsius;           /* results until the temperature is read again */
#endif
} sensor;

/*
 * Set up the sensor. Returns 0, or a negative SENSOR_E_..., which sensor_text() describes. `buses` points to a constant
 * array of SENSOR_BUSES buses. It must exist as long as the sensor: `sensor_begin(&one, &buses)`.
 */
int sensor_begin(sensor *self, const ldc161x_bus (*buses)[SENSOR_BUSES]);

/*
 * Read new results. Returns the number of coils with a new result, or a negative error of the bus or of lost settings.
 * A coil without a new result keeps its counts. It becomes SENSOR_STALE when another coil has been read twice since, or
 * when no coil has a new result. A result that jumps by more than noise and motion explain counts only when the next
 * result confirms it. A single wrong value is therefore never passed on, and a true step arrives one scan later.
 */
int sensor_poll(sensor *self, sensor_reading *reading);

/*
 * Test each coil against the design. Polls until every coil has a result; a bad coil is read twice. Returns the number
 * of bad coils, or a negative error. The tare must be repeated afterwards.
 */
int sensor_self_test(sensor *self, sensor_report *report);

/*
 * Store the counts without load. Calls in consecutive scans take the mean, if every coil has a new result. A mean of 16
 * has a quarter of the noise. A call more than two scans later begins a new tare. Returns 0, or the number (from 1) of
 * a coil without a good reading; the old tare then stays. The temperature is stored, too. If a reading of the tare has
 * no valid temperature, forces are not compensated until a new tare.
 */
int sensor_tare(sensor *self, const sensor_reading *reading);

#ifdef SENSOR_THERMOMETER
/*
 * Set the function that returns the temperature (degC), or NAN if it is not valid. Call this after sensor_begin.
 * sensor_poll calls the function with `context`, about ten times a second. thermometer.h has functions for the part.
 */
void sensor_set_thermometer(sensor *self, float (*celsius)(const void *context), const void *context);
#endif

#ifdef SENSOR_COMPENSATED
/* Return the temperature change (K) since the tare, by the reference coil or by the thermometer. NAN if not valid. */
float sensor_warming(const sensor *self, const sensor_reading *reading);
#endif

/*
 * Compute the forces on a cell (0 to SENSOR_CELLS - 1; 0 for a sensor without cells). Forces are newtons, moments are
 * newton metres. Returns 0, or a negative error. If a coil of this cell has no good reading, returns its number (from
 * 1), with forces 0. Beyond the range of the map, returns SENSOR_BEYOND, with the forces at the end of the range.
 * If the design measures its temperature, the forces are compensated by the temperature change since the tare. Without
 * a valid change within the range of temperature.h, returns SENSOR_NO_TEMPERATURE, with uncompensated forces.
 */
int sensor_cell_forces(const sensor *self, const sensor_reading *reading, int cell, float newtons[SENSOR_AXES]);

#ifndef SENSOR_HAS_CELLS
/* Compute the forces of a sensor without cells: cell 0. */
int sensor_forces(const sensor *self, const sensor_reading *reading, float newtons[SENSOR_AXES]);
#endif

const char *sensor_text(int error);      /* text for SENSOR_E_... */
const char *sensor_coil_text(int coil);  /* text for SENSOR_COIL_... */
const char *sensor_coil_name(int index); /* a coil's name in the design; index from 0 */

#ifdef __cplusplus
}
#endif

#endif
