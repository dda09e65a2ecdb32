/*
 * Readings as lines of text for a serial port. `sitscad read serial:PORT` and live.html read these lines.
 *
 *     id,sequence,C1_counts,C1_status,...,normal_N*crc     a header, first and after every SENSOR_HEAD_EVERY lines
 *     3F1A9C04,17,28286800,0,...,0.0125*9A3C               a reading; without newtons if there are none
 *     # text                                               a comment for people
 *
 * If the design measures its temperature, the last column is warming_K, the temperature change since the tare. If it is
 * empty, there is no valid temperature, and the newtons are not compensated.
 * For a sensor with cells, the names of the coils stand before each force: C1.normal_N, or C1+C2.normal_N.
 * id is SENSOR_ID, equal for all boards with this design and these settings. sequence counts the lines from 0 after a
 * start. crc is CRC-16 CCITT (initial value 0xFFFF) over all characters before the star, in four hexadecimal digits.
 */
#ifndef SENSOR_LINE_H
#define SENSOR_LINE_H

#include "sensor.h"

#define SENSOR_HEAD_EVERY 100u
/* largest number of characters of a header and a reading together */
#define SENSOR_LINE_MOST (128 + SENSOR_COILS * 64 + SENSOR_CELLS * SENSOR_AXES * (24 + SENSOR_CELL_COILS * 32))

typedef struct {
    uint32_t sequence; /* number of the next reading */
    int fresh;         /* results since the last line */
    size_t count;
    uint16_t crc;
    char text[SENSOR_LINE_MOST];
} sensor_line;

static inline void sensor_line_put(sensor_line *line, char one)
{
    if (line->count + 1u >= sizeof line->text)
        return;
    line->text[line->count++] = one;
    line->crc = (uint16_t)(line->crc ^ (unsigned)(unsigned char)one << 8);
    for (int bit = 0; bit < 8; ++bit)
        line->crc = (uint16_t)((unsigned)line->crc << 1 ^ ((line->crc & 0x8000u) != 0u ? 0x1021u : 0u));
}

static inline void sensor_line_words(sensor_line *line, const char *text)
{
    while (*text != '\0')
        sensor_line_put(line, *text++);
}

static inline void sensor_line_hex(sensor_line *line, uint32_t value, int digits)
{
    while (digits-- > 0)
        sensor_line_put(line, "0123456789ABCDEF"[value >> 4 * digits & 15u]);
}

static inline void sensor_line_number(sensor_line *line, uint32_t value, int least)
{
    char digits[10];
    int many = 0;

    for (; value != 0u || many < least; value /= 10u)
        digits[many++] = (char)('0' + value % 10u);
    while (many > 0)
        sensor_line_put(line, digits[--many]);
}

/* Write newtons with a resolution of 0.1 mN, and moments with 0.0001 N mm. */
static inline void sensor_line_force(sensor_line *line, float newtons)
{
    const float size = newtons < 0.0f ? -newtons : newtons;
    const uint32_t steps = size < 4e5f ? (uint32_t)(size * 1e4f + 0.5f) : 4000000000u;

    sensor_line_words(line, newtons < 0.0f ? ",-" : ",");
    sensor_line_number(line, steps / 10000u, 1);
    sensor_line_put(line, '.');
    sensor_line_number(line, steps % 10000u, 4);
}

/* Name of an axis in a header. Empty without a map. */
static inline const char *sensor_line_axis(int axis)
{
#ifdef SITSCAD_NORMAL
    if (axis == SITSCAD_NORMAL)
        return "normal_N";
#endif
#ifdef SITSCAD_SHEAR_X
    if (axis == SITSCAD_SHEAR_X)
        return "shear_x_N";
#endif
#ifdef SITSCAD_SHEAR_Y
    if (axis == SITSCAD_SHEAR_Y)
        return "shear_y_N";
#endif
#ifdef SITSCAD_MOMENT_X
    if (axis == SITSCAD_MOMENT_X)
        return "moment_x_Nmm";
#endif
#ifdef SITSCAD_MOMENT_Y
    if (axis == SITSCAD_MOMENT_Y)
        return "moment_y_Nmm";
#endif
    (void)axis;
    return "";
}

/* Factor of an axis in a line. Moments are newton metres in the map and newton millimetres here. */
static inline float sensor_line_scale(int axis)
{
#ifdef SITSCAD_MOMENT_X
    if (axis == SITSCAD_MOMENT_X)
        return 1000.0f;
#endif
#ifdef SITSCAD_MOMENT_Y
    if (axis == SITSCAD_MOMENT_Y)
        return 1000.0f;
#endif
    (void)axis;
    return 1.0f;
}

static inline void sensor_line_crc(sensor_line *line)
{
    const uint16_t crc = line->crc;

    sensor_line_put(line, '*');
    sensor_line_hex(line, crc, 4);
}

/* Write the names of the columns. */
static inline void sensor_line_head(sensor_line *line)
{
    line->crc = 0xFFFFu;
    sensor_line_words(line, "id,sequence");
    for (int k = 0; k < SENSOR_COILS; ++k)
        for (int what = 0; what < 2; ++what) {
            sensor_line_put(line, ',');
            sensor_line_words(line, sensor_coil_name(k));
            sensor_line_words(line, what == 0 ? "_counts" : "_status");
        }
    for (int cell = 0; cell < SENSOR_CELLS; ++cell)
        for (int axis = 0; axis < SENSOR_AXES && sensor_line_axis(axis)[0] != '\0'; ++axis) {
            for (int k = 0; k < SENSOR_CELL_COILS && SENSOR_CELLS > 1; ++k) {
                sensor_line_put(line, k == 0 ? ',' : '+');
                sensor_line_words(line, sensor_coil_name(cell * SENSOR_CELL_COILS + k));
            }
            sensor_line_put(line, SENSOR_CELLS > 1 ? '.' : ',');
            sensor_line_words(line, sensor_line_axis(axis));
        }
#if defined(SENSOR_COMPENSATED) && defined(SITSCAD_AXES)
    sensor_line_words(line, ",warming_K");
#endif
    sensor_line_crc(line);
    sensor_line_put(line, '\n');
}

/*
 * Write a reading. `told` has the return value of sensor_cell_forces for each cell. `kelvin` is the temperature change
 * since the tare, NAN if it is not valid.
 */
static inline void sensor_line_reading(sensor_line *line, const sensor_reading *reading, const int told[SENSOR_CELLS],
                                       float kelvin, float newtons[SENSOR_CELLS][SENSOR_AXES])
{
    int is_compensated = kelvin == kelvin; /* NAN differs from itself */

    line->crc = 0xFFFFu;
    sensor_line_hex(line, SENSOR_ID, 8);
    sensor_line_put(line, ',');
    sensor_line_number(line, line->sequence++, 1);
    for (int k = 0; k < SENSOR_COILS; ++k) {
        sensor_line_put(line, ',');
        sensor_line_number(line, reading->counts[k], 1);
        sensor_line_put(line, ',');
        sensor_line_number(line, reading->status[k], 1);
    }
    for (int cell = 0; cell < SENSOR_CELLS; ++cell) {
        is_compensated = is_compensated && told[cell] != SENSOR_NO_TEMPERATURE;
        for (int axis = 0; axis < SENSOR_AXES && sensor_line_axis(axis)[0] != '\0'; ++axis) {
            if (told[cell] == 0 || told[cell] == SENSOR_NO_TEMPERATURE)
                sensor_line_force(line, newtons[cell][axis] * sensor_line_scale(axis));
            else
                sensor_line_put(line, ',');
        }
    }
#if defined(SENSOR_COMPENSATED) && defined(SITSCAD_AXES)
    if (is_compensated)
        sensor_line_force(line, kelvin);
    else
        sensor_line_put(line, ',');
#else
    (void)is_compensated;
#endif
    sensor_line_crc(line);
}

/*
 * Return the text to send after a poll with `fresh` new results: NULL until SENSOR_LINE_EVERY scans are complete, then
 * a line, after a header if one is due. Set `line` to {0} at the start. SENSOR_BAUD is enough for these lines.
 */
static inline const char *sensor_line_next(sensor_line *line, const sensor *self, const sensor_reading *reading,
                                           int fresh)
{
    float newtons[SENSOR_CELLS][SENSOR_AXES], kelvin = 0.0f;
    int told[SENSOR_CELLS];

    line->fresh += fresh > 0 ? fresh : 0;
    if (line->fresh < SENSOR_COILS * SENSOR_LINE_EVERY)
        return NULL;
    line->fresh = 0;
    line->count = 0u;
    if (line->sequence % SENSOR_HEAD_EVERY == 0u)
        sensor_line_head(line);
    for (int cell = 0; cell < SENSOR_CELLS; ++cell)
        told[cell] = sensor_cell_forces(self, reading, cell, newtons[cell]);
#ifdef SENSOR_COMPENSATED
    kelvin = sensor_warming(self, reading);
#endif
    sensor_line_reading(line, reading, told, kelvin, newtons);
    line->text[line->count] = '\0';
    return line->text;
}

#endif
