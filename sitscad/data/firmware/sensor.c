/* The driver of sensor.h. sensor_config.h has its tables. */
#include "sensor.h"

#define NOTHING_NEW 4u /* polls without a new result, after which the settings are checked */
#define STUCK 200u     /* equal results in a row; by noise alone, less than one in 1e40 readings */
#define MOSTLY_SHORTED (-800) /* thousandths of the inductance */
#define MOST_TARES 100u
#define APART 2u /* scans without a call after which a new tare begins */

typedef struct {
    uint8_t converter, where;
    uint16_t value;
} setting;

typedef struct {
    uint32_t counts, low, high;
} band; /* the design's value, and the limits by manufacturing tolerances */

typedef struct {
    const char *name;
    uint8_t converter, channel;
    uint32_t low, high; /* limits of results in all states and under all loads */
    uint32_t leap;      /* largest change by noise alone */
    band state[2];      /* bare, assembled */
} coil;

#define SENSING (SENSOR_CELLS * SENSOR_CELL_COILS) /* coils with a target: all but the reference coil */

static const uint8_t buses[SENSOR_CONVERTERS] = SENSOR_BUS_OF;
static const uint8_t addresses[SENSOR_CONVERTERS] = SENSOR_ADDRESSES;
static const setting settings[] = SENSOR_SETTINGS; /* in the order of writing; CONFIG comes last */
static const coil coils[SENSOR_COILS] = SENSOR_COIL_TABLE;

static const ldc161x_bus *bus_of(const sensor *self, uint8_t converter)
{
    return &self->bus[buses[converter]];
}

static int is_config(size_t row)
{
    return settings[row].where == LDC161X_CONFIG;
}

static int compared(const sensor *self, size_t row)
{
    const setting *one = &settings[row];
    const uint16_t kept = ldc161x_kept(one->where);
    uint16_t value;

    if (ldc161x_read(bus_of(self, one->converter), addresses[one->converter], one->where, &value) != 0)
        return SENSOR_E_BUS;
    return ((value ^ one->value) & kept) != 0u ? SENSOR_E_SETTINGS : 0;
}

/* Check the identity, reset (the converter then sleeps), write all registers, read them back. CONFIG comes last. */
static int set_up(sensor *self, uint8_t converter)
{
    const size_t rows = sizeof settings / sizeof settings[0];
    const ldc161x_bus *bus = bus_of(self, converter);
    const uint8_t address = addresses[converter];
    uint16_t maker, device;

    if (ldc161x_read(bus, address, LDC161X_MANUFACTURER_ID, &maker) != 0 ||
        ldc161x_read(bus, address, LDC161X_DEVICE_ID, &device) != 0)
        return SENSOR_E_BUS;
    if (maker != LDC161X_MANUFACTURER || device != LDC161X_DEVICE)
        return SENSOR_E_IDENTITY;
    if (ldc161x_write(bus, address, LDC161X_RESET_DEV, LDC161X_RESET) != 0)
        return SENSOR_E_BUS;
    for (size_t row = 0u; row < rows; ++row)
        if (settings[row].converter == converter && !is_config(row) &&
            ldc161x_write(bus, address, settings[row].where, settings[row].value) != 0)
            return SENSOR_E_BUS;
    for (size_t row = 0u; row < rows; ++row)
        if (settings[row].converter == converter) {
            int error = 0;
            if (is_config(row))
                error = ldc161x_write(bus, address, LDC161X_CONFIG, settings[row].value);
            if (error != 0)
                return SENSOR_E_BUS;
            error = compared(self, row);
            if (error != 0)
                return error;
        }
    self->idle[converter] = 0u;
    self->lost[converter] = 0u;
    return 0;
}

int sensor_begin(sensor *self, const ldc161x_bus (*given)[SENSOR_BUSES])
{
    unsigned char *const bytes = (unsigned char *)self;
    int error = 0;

    for (size_t k = 0u; k < sizeof *self; ++k)
        bytes[k] = 0u;
    self->bus = *given;
    for (int k = 0; k < SENSOR_COILS; ++k)
        self->status[k] = SENSOR_STALE;
    for (uint8_t converter = 0u; converter < SENSOR_CONVERTERS && error == 0; ++converter)
        error = set_up(self, converter);
    return error;
}

static uint32_t apart(uint32_t one, uint32_t other)
{
    return one > other ? one - other : other - one;
}

static uint8_t status_of(const coil *own, uint32_t counts, uint8_t flags)
{
    if ((flags & LDC161X_WATCHDOG) != 0u)
        return SENSOR_WATCHDOG;
    if ((flags & LDC161X_UNDER_RANGE) != 0u || counts == 0u)
        return SENSOR_UNDER_RANGE;
    if ((flags & LDC161X_OVER_RANGE) != 0u || counts >= LDC161X_LARGEST)
        return SENSOR_OVER_RANGE;
    if (counts < own->low || counts > own->high)
        return SENSOR_OUT_OF_BAND;
    return (flags & LDC161X_AMPLITUDE) != 0u ? SENSOR_AMPLITUDE : SENSOR_GOOD;
}

static int is_good(uint8_t status)
{
    return status == SENSOR_GOOD || status == SENSOR_AMPLITUDE;
}

/*
 * Whether a result is accepted: its distance from the last accepted result is at most twice the last step plus `leap`,
 * or it continues from the doubted result and thereby confirms it.
 */
static int is_believed(const sensor *self, int k, uint32_t counts)
{
    const uint32_t leap = coils[k].leap;

    if (self->counts[k] == 0u || apart(counts, self->counts[k]) <= leap + 2u * self->step[k])
        return 1;
    return self->doubted[k] != 0u && apart(counts, self->result[k]) <= leap + apart(self->result[k], self->counts[k]);
}

/* Store a result of coil k. Returns 1 if it is passed on. */
static int take(sensor *self, int k, uint32_t counts, uint8_t flags)
{
    const uint8_t status = status_of(&coils[k], counts, flags);
    int is_new = 1;

    self->alike[k] = counts != self->result[k] ? 0u : (uint8_t)(self->alike[k] + (self->alike[k] < STUCK));
    self->behind[k] = 0u;
    self->amplitude[k] = (uint8_t)(flags & LDC161X_AMPLITUDE);
    if (!is_good(status)) {
        self->doubted[k] = 0u;
        self->counts[k] = 0u; /* after a fault there is no result to compare with */
        self->status[k] = status;
    } else if (self->alike[k] >= STUCK) {
        self->status[k] = SENSOR_STALE;
    } else if (is_believed(self, k, counts)) {
        self->step[k] = self->counts[k] == 0u ? 0u
                        : apart(counts, self->doubted[k] != 0u ? self->result[k] : self->counts[k]);
        self->doubted[k] = 0u;
        self->counts[k] = counts;
        self->status[k] = status;
    } else {
        self->doubted[k] = 1u;
        self->status[k] = SENSOR_STALE;
        is_new = 0;
    }
    self->result[k] = counts;
    self->since[k] = (uint8_t)(self->since[k] + (is_new && self->since[k] < 255u));
    return is_new;
}

/* Check the settings of a converter without new results. Set it up again if they are lost. */
static int idle(sensor *self, uint8_t converter)
{
    const size_t rows = sizeof settings / sizeof settings[0];
    int error = 0;

    if (self->lost[converter] == 0u && ++self->idle[converter] < NOTHING_NEW)
        return 0;
    self->idle[converter] = 0u;
    for (size_t row = 0u; row < rows && self->lost[converter] == 0u; ++row)
        if (settings[row].converter == converter && is_config(row)) {
            error = compared(self, row);
            if (error == SENSOR_E_BUS)
                return error;
            self->lost[converter] = error != 0;
        }
    if (self->lost[converter] == 0u)
        return 0;
    error = set_up(self, converter);
    if (error == 0)
        self->restarts++;
    return error != 0 ? error : SENSOR_E_LOST;
}

/* Read the new results of one converter. Returns the number of coils that are passed on, or a negative error. */
static int poll_one(sensor *self, uint8_t converter, uint8_t fresh[SENSOR_COILS], int *read)
{
    uint8_t unread, flags;
    uint32_t counts;
    int new_ones = 0, seen = 0;

    if (self->lost[converter] != 0u)
        return idle(self, converter);
    if (ldc161x_unread(bus_of(self, converter), addresses[converter], &unread) != 0)
        return SENSOR_E_BUS;
    for (int k = 0; k < SENSOR_COILS; ++k)
        if (coils[k].converter == converter && ((unsigned)unread >> coils[k].channel & 1u) != 0u) {
            if (ldc161x_result(bus_of(self, converter), addresses[converter], coils[k].channel, &counts, &flags) != 0)
                return SENSOR_E_BUS;
            new_ones += fresh[k] = (uint8_t)take(self, k, counts, flags);
            ++seen;
            for (int other = 0; other < SENSOR_COILS; ++other)
                if (other != k && self->behind[other] < 255u)
                    self->behind[other]++;
        }
    *read += seen;
    if (seen == 0)
        return idle(self, converter);
    self->idle[converter] = 0u;
    return new_ones;
}

int sensor_poll(sensor *self, sensor_reading *reading)
{
    uint8_t fresh[SENSOR_COILS] = {0u};
    int new_ones = 0, read = 0, error = 0;

    for (uint8_t converter = 0u; converter < SENSOR_CONVERTERS; ++converter) {
        const int found = poll_one(self, converter, fresh, &read);
        if (found >= 0)
            new_ones += found;
        else
            error = found;
    }
    for (int k = 0; k < SENSOR_COILS; ++k) {
        const uint32_t counts = self->counts[k] != 0u ? self->counts[k] : self->result[k];
        /* one scan reads every other coil once */
        const int is_old = fresh[k] == 0u && (new_ones == 0 || self->behind[k] > 2u * (SENSOR_COILS - 1u));
        reading->counts[k] = counts;
        reading->status[k] = is_old || error != 0 ? (uint8_t)SENSOR_STALE : self->status[k];
        reading->frequency_Hz[k] = (float)counts * SENSOR_HZ_PER_COUNT;
    }
#ifdef SENSOR_THERMOMETER
    if (new_ones >= (int)self->until_celsius) {
        self->celsius = self->thermometer != NULL ? self->thermometer(self->context) : NAN;
        self->until_celsius = SENSOR_CELSIUS_EVERY;
    } else {
        self->until_celsius = (uint16_t)(self->until_celsius - new_ones);
    }
    reading->celsius = self->celsius;
#endif
    return error != 0 ? error : new_ones;
}

/* Deviation of the inductance from the design, in thousandths. L is proportional to 1 / counts^2. */
static int16_t off_design(uint32_t design, uint32_t counts)
{
    const uint64_t own = counts >> 8, wanted = design >> 8;
    uint64_t ratio;

    if (own == 0u)
        return INT16_MAX;
    ratio = (wanted * wanted * 1000u + own * own / 2u) / (own * own);
    return (int16_t)(ratio > 30000u ? 29000 : (int)ratio - 1000);
}

static uint8_t tested(const band *design, uint32_t counts, uint8_t status)
{
    if (counts == 0u || status == SENSOR_WATCHDOG || status == SENSOR_UNDER_RANGE)
        return SENSOR_COIL_OPEN;
    if (counts < design->low || status == SENSOR_OVER_RANGE)
        return SENSOR_COIL_OUT_OF_BAND;
    if (counts <= design->high)
        return SENSOR_COIL_OK;
    return off_design(design->counts, counts) < MOSTLY_SHORTED ? SENSOR_COIL_SHORT : SENSOR_COIL_TURNS_MISSING;
}

/* Find the state of the design: more coils lie within their bands, or else the deviations are smaller. */
static uint8_t state_of(const sensor *self)
{
    uint32_t away[2] = {0u, 0u};
    int fit[2] = {0, 0};

    for (int k = 0; k < SENSOR_COILS; ++k)
        for (int state = 0; state < 2; ++state) {
            const band *design = &coils[k].state[state];
            fit[state] += self->result[k] >= design->low && self->result[k] <= design->high;
            away[state] += apart(self->result[k], design->counts) / SENSOR_COILS;
        }
    if (fit[0] != fit[1])
        return fit[1] > fit[0] ? SENSOR_ASSEMBLED : SENSOR_BARE;
    return away[1] <= away[0] ? SENSOR_ASSEMBLED : SENSOR_BARE;
}

/* Find pairs of exchanged coils: their designs differ by more than tolerances, and their readings are exchanged. */
static void look_for_exchanged(sensor_report *report)
{
    for (int k = 0; k < SENSOR_COILS; ++k)
        for (int other = 0; other < k; ++other) {
            const uint32_t a = coils[k].state[report->state].counts, b = coils[other].state[report->state].counts;
            const uint32_t now = report->counts[k], then = report->counts[other];
            if (apart(a, b) < SENSOR_UNLIKE) {
                report->told_apart = 0u;
            } else if (now != 0u && then != 0u && (a > b) != (now > then) && apart(now, then) >= SENSOR_UNLIKE / 5u) {
                report->coil[k] = SENSOR_COIL_EXCHANGED;
                report->coil[other] = SENSOR_COIL_EXCHANGED;
            }
        }
}

int sensor_self_test(sensor *self, sensor_report *report)
{
    sensor_reading reading;
    int missing = SENSOR_COILS, wrong = 0;

    for (int k = 0; k < SENSOR_COILS; ++k) {
        self->result[k] = self->counts[k] = 0u;
        self->status[k] = SENSOR_STALE;
        self->since[k] = 0u;
    }
    for (uint32_t poll = 0u; poll < SENSOR_POLLS && missing > 0; ++poll) {
        const int found = sensor_poll(self, &reading);
        if (found < 0)
            return found;
        missing = 0;
        for (int k = 0; k < SENSOR_COILS; ++k) /* a single bad result may be wrong: wait for the next one */
            missing += self->since[k] < (is_good(self->status[k]) ? 1u : 2u);
    }
    report->state = state_of(self);
    report->told_apart = SENSOR_COILS > 1;
    for (int k = 0; k < SENSOR_COILS; ++k) {
        const band *design = &coils[k].state[report->state];
        report->counts[k] = self->result[k];
        report->amplitude[k] = (uint8_t)(self->amplitude[k] != 0u);
        report->inductance[k] = off_design(design->counts, self->result[k]);
        report->coil[k] = self->since[k] == 0u ? (uint8_t)SENSOR_COIL_SILENT
                                               : tested(design, self->result[k], self->status[k]);
        self->since[k] = 255u; /* the next call begins a new tare */
    }
    look_for_exchanged(report);
    for (int k = 0; k < SENSOR_COILS; ++k)
        wrong += report->coil[k] != SENSOR_COIL_OK;
    return wrong;
}

static int first_bad(const sensor_reading *reading, int first, int count)
{
    for (int k = first; k < first + count; ++k)
        if (!is_good(reading->status[k]))
            return k + 1;
    return 0;
}

int sensor_tare(sensor *self, const sensor_reading *reading)
{
    const int bad = first_bad(reading, 0, SENSING);
    uint8_t scans = 255u;

    if (bad != 0)
        return bad;
    for (int k = 0; k < SENSING; ++k)
        scans = self->since[k] < scans ? self->since[k] : scans;
    if (self->tares != 0u && scans == 0u)
        return 0;
    if (scans > APART)
        self->tares = 0u;
    if (self->tares < MOST_TARES)
        self->tares++;
    for (int k = 0; k < SENSOR_COILS; ++k) {
        const int32_t off = (int32_t)reading->counts[k] - (int32_t)self->tare[k];
        self->tare[k] = self->tares == 1u ? reading->counts[k] : (uint32_t)((int32_t)self->tare[k] + off / self->tares);
        self->since[k] = 0u;
    }
#ifdef SENSOR_REFERENCE
    if (self->tares == 1u || !is_good(reading->status[SENSOR_REFERENCE]))
        self->is_tare_faulty = (uint8_t)!is_good(reading->status[SENSOR_REFERENCE]);
#endif
#ifdef SENSOR_THERMOMETER
    if (self->tares == 1u)
        self->tare_celsius = reading->celsius;
    else
        self->tare_celsius += (reading->celsius - self->tare_celsius) / (float)self->tares; /* NAN stays NAN */
#endif
    return 0;
}

#ifdef SENSOR_THERMOMETER
void sensor_set_thermometer(sensor *self, float (*celsius)(const void *context), const void *context)
{
    self->thermometer = celsius;
    self->context = context;
    self->until_celsius = 0u;
}
#endif

#if defined(SENSOR_COMPENSATED) && defined(SENSOR_THERMOMETER) && !defined(SITSCAD_BY_REFERENCE)
/* Whether a temperature is within the range of measured coefficients. NAN is not. */
static int is_calibrated(float celsius)
{
#ifdef SITSCAD_COLDEST
    const float margin = 0.05f * (SITSCAD_HOTTEST - SITSCAD_COLDEST); /* for errors of the temperature readings */

    return celsius >= SITSCAD_COLDEST - margin && celsius <= SITSCAD_HOTTEST + margin;
#else
    return celsius == celsius;
#endif
}
#endif

#ifdef SENSOR_COMPENSATED
float sensor_warming(const sensor *self, const sensor_reading *reading)
{
#if defined(SITSCAD_BY_REFERENCE)
    const int is_valid = is_good(reading->status[SENSOR_REFERENCE]) && self->tares != 0u && self->is_tare_faulty == 0u;

    return is_valid ? sitscad_warming(reading->counts[SENSOR_REFERENCE], self->tare[SENSOR_REFERENCE]) : NAN;
#elif defined(SENSOR_THERMOMETER)
    const int is_valid = self->tares != 0u && is_calibrated(reading->celsius) && is_calibrated(self->tare_celsius);

    return is_valid ? reading->celsius - self->tare_celsius : NAN;
#else
    (void)self;
    (void)reading;
    return NAN;
#endif
}
#endif

#ifdef SITSCAD_AXES
/*
 * Compute forces by the map of a cell from the counts of its coils, their tare, and the temperature change (K) since
 * the tare. Returns SITSCAD_OK or an error.
 */
static int mapped(int cell, const uint32_t *counts, const uint32_t *rest, float kelvin, float newtons[SENSOR_AXES])
{
#ifdef SENSOR_HAS_CELLS
    return sensor_cell_map(cell, counts, rest, kelvin, newtons);
#else
    struct sitscad_tare tare;

    (void)cell;
    for (int k = 0; k < SENSOR_CELL_COILS; ++k)
        tare.counts[k] = rest[k];
#ifdef SITSCAD_NO_TEMPERATURE
    return sitscad_compensated(counts, &tare, kelvin, newtons);
#else
    (void)kelvin;
    return sitscad_forces(counts, &tare, newtons);
#endif
#endif
}

static int forces_error(int found)
{
#ifdef SITSCAD_NO_TEMPERATURE
    if (found == SITSCAD_NO_TEMPERATURE)
        return SENSOR_NO_TEMPERATURE;
#elif defined(SENSOR_COMPENSATED)
    (void)found; /* temperature.h is missing */
    return SENSOR_NO_TEMPERATURE;
#endif
    return found == SITSCAD_OK ? 0 : SENSOR_BEYOND;
}
#endif

int sensor_cell_forces(const sensor *self, const sensor_reading *reading, int cell, float newtons[SENSOR_AXES])
{
    const int first = cell * SENSOR_CELL_COILS;
    float kelvin = 0.0f;
    int bad;

    for (int axis = 0; axis < SENSOR_AXES; ++axis)
        newtons[axis] = 0.0f;
    if (cell < 0 || cell >= SENSOR_CELLS)
        return SENSOR_E_NO_MAP;
    if (self->tares == 0u)
        return SENSOR_E_NO_TARE;
    bad = first_bad(reading, first, SENSOR_CELL_COILS);
    if (bad != 0)
        return bad;
#if defined(SITSCAD_AXES) && defined(SENSOR_COMPENSATED)
    kelvin = sensor_warming(self, reading);
#endif
#if defined(SITSCAD_AXES)
    return forces_error(mapped(cell, &reading->counts[first], &self->tare[first], kelvin, newtons));
#else
    (void)kelvin;
    return SENSOR_E_NO_MAP;
#endif
}

#ifndef SENSOR_HAS_CELLS
int sensor_forces(const sensor *self, const sensor_reading *reading, float newtons[SENSOR_AXES])
{
    return sensor_cell_forces(self, reading, 0, newtons);
}
#endif

const char *sensor_text(int error)
{
    switch (error) {
    case 0:
        return "good";
    case SENSOR_E_BUS:
        return "no answer on the I2C bus: SD low, supply, pull-ups, address by ADDR";
    case SENSOR_E_IDENTITY:
        return "no LDC1612 or LDC1614 answers: check the address";
    case SENSOR_E_SETTINGS:
        return "a register does not hold the written value";
    case SENSOR_E_LOST:
        return "a converter lost its settings (reset or brown-out) and was set up again";
    case SENSOR_E_NO_TARE:
        return "no tare: take one without load";
    case SENSOR_E_NO_MAP:
        return "no map to newtons: compile with calibration.h";
#ifdef SENSOR_COMPENSATED
    case SENSOR_NO_TEMPERATURE:
        return "no valid temperature: the forces are not compensated";
#endif
    default:
        return error > 0 ? "a coil has no good reading" : "unknown error";
    }
}

const char *sensor_coil_text(int found)
{
    static const char *const texts[] = {
        "good",
        "does not oscillate: open, or shorted from end to end",
        "inductance very low: most turns are shorted",
        "inductance low: a layer is missing or turns are shorted",
        "reads as another coil of the design: exchanged",
        "inductance or capacitor beyond the design's band",
        "the converter gives no result",
    };

    return found >= 0 && (size_t)found < sizeof texts / sizeof texts[0] ? texts[found] : "unknown";
}

const char *sensor_coil_name(int index)
{
    return index >= 0 && index < SENSOR_COILS ? coils[index].name : "";
}
