/*
 * Readings as lines of text, for a serial port: `sitscad read serial:PORT` and live.html read them.
 *
 *     id,sequence,C1_counts,C1_status,...,normal_N*crc     a header, first and after every SENSOR_HEAD_EVERY lines
 *     3F1A9C04,17,28286800,0,...,0.0125*9A3C               a reading; newtons are left out where there are none
 *     # words                                              what people read
 *
 * id is SENSOR_ID, the same for boards of one design and its settings; sequence goes up by 1 a line, and from 0 again
 * after a start; crc is CRC-16 CCITT from 0xFFFF over all before the star, four hexadecimal digits.
 */
#ifndef SENSOR_LINE_H
#define SENSOR_LINE_H

#include "sensor.h"

#define SENSOR_HEAD_EVERY 100u
#define SENSOR_LINE_MOST (96 + SENSOR_COILS * 64 + SENSOR_AXES * 24) /* characters: a header and a reading */

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
#ifdef SITSCAD_NORMAL
    sensor_line_words(line, ",normal_N");
#endif
#ifdef SITSCAD_SHEAR_X
    sensor_line_words(line, ",shear_x_N");
#endif
#ifdef SITSCAD_SHEAR_Y
    sensor_line_words(line, ",shear_y_N");
#endif
#ifdef SITSCAD_MOMENT_X
    sensor_line_words(line, ",moment_x_Nmm");
#endif
#ifdef SITSCAD_MOMENT_Y
    sensor_line_words(line, ",moment_y_Nmm");
#endif
    sensor_line_crc(line);
    sensor_line_put(line, '\n');
}

/* A reading; newtons by `told`, what sensor_forces said. */
static inline void sensor_line_reading(sensor_line *line, const sensor_reading *reading, int told,
                                       const float newtons[SENSOR_AXES])
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
    for (int axis = 0; axis < SENSOR_AXES && told != SENSOR_E_NO_MAP; ++axis) {
        if (told == 0)
            sensor_line_force(line, newtons[axis] * sensor_line_scale(axis));
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
    float newtons[SENSOR_AXES];
    int told;

    line->fresh += fresh > 0 ? fresh : 0;
    if (line->fresh < SENSOR_COILS * SENSOR_LINE_EVERY)
        return NULL;
    line->fresh = 0;
    line->count = 0u;
    if (line->sequence % SENSOR_HEAD_EVERY == 0u)
        sensor_line_head(line);
    told = sensor_forces(self, reading, newtons);
    sensor_line_reading(line, reading, told, newtons);
    line->text[line->count] = '\0';
    return line->text;
}

#endif
