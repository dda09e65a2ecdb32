/*
 * Readings as lines of text, for a serial port: `sitscad read serial:PORT` and live.html read them.
 *
 *     id,sequence,C1_counts,C1_status,...,normal_N*crc     a header, first and after every SENSOR_HEAD_EVERY lines
 *     3F1A9C04,17,28286800,0,...,0.0125*9A3C               a reading; newtons are left out where there are none
 *     # words                                              what people read
 *
 * Forces of a cell have the names of its coils before them: C1.normal_N, or C1+C2.normal_N.
 * id is SENSOR_ID, the same for boards of one design and its settings; sequence goes up by 1 a line, and from 0 again
 * after a start; crc is CRC-16 CCITT from 0xFFFF over all before the star, four hexadecimal digits.
 */
#ifndef SENSOR_LINE_H
#define SENSOR_LINE_H

#include "sensor.h"

#define SENSOR_HEAD_EVERY 100u
/* characters: a header and a reading */
#define SENSOR_LINE_MOST (96 + SENSOR_COILS * 64 + SENSOR_CELLS * SENSOR_AXES * (24 + SENSOR_CELL_COILS * 32))

typedef struct {
    uint32_t sequence; /* of the next reading */
    int fresh;         /* results since the last */
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

/* Newtons to a tenth of a millinewton; newton millimetres of moments alike. */
static inline void sensor_line_force(sensor_line *line, float newtons)
{
    const float size = newtons < 0.0f ? -newtons : newtons;
    const uint32_t steps = size < 4e5f ? (uint32_t)(size * 1e4f + 0.5f) : 4000000000u;

    sensor_line_words(line, newtons < 0.0f ? ",-" : ",");
    sensor_line_number(line, steps / 10000u, 1);
    sensor_line_put(line, '.');
    sensor_line_number(line, steps % 10000u, 4);
}

/* The name of an axis in a header; empty without a map. */
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

/* What an axis is multiplied with in a line: moments are newton metres in the map, newton millimetres here. */
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

/* The names of the columns. */
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
    sensor_line_crc(line);
    sensor_line_put(line, '\n');
}

/* A reading; newtons of each cell by `told`, what sensor_cell_forces said. */
static inline void sensor_line_reading(sensor_line *line, const sensor_reading *reading, const int told[SENSOR_CELLS],
                                       float newtons[SENSOR_CELLS][SENSOR_AXES])
{
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
    for (int cell = 0; cell < SENSOR_CELLS; ++cell)
        for (int axis = 0; axis < SENSOR_AXES && sensor_line_axis(axis)[0] != '\0'; ++axis) {
            if (told[cell] == 0)
                sensor_line_force(line, newtons[cell][axis] * sensor_line_scale(axis));
            else
                sensor_line_put(line, ',');
        }
    sensor_line_crc(line);
}

/*
 * What is to be sent after a poll that found `fresh` results: NULL until SENSOR_LINE_EVERY scans are complete, then a
 * line, with a header before it if one is due. `line` begins as {0}. SENSOR_BAUD carries these lines.
 */
static inline const char *sensor_line_next(sensor_line *line, const sensor *self, const sensor_reading *reading,
                                           int fresh)
{
    float newtons[SENSOR_CELLS][SENSOR_AXES];
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
    sensor_line_reading(line, reading, told, newtons);
    line->text[line->count] = '\0';
    return line->text;
}

#endif
