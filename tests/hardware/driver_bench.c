/* The driver on simulated converters, by commands on standard input: what it says goes to standard output. */
#include <stdio.h>
#include <string.h>

#include "sensor.h"
#include "simulated/simulated.h"
#ifdef SENSOR_THERMOMETER
#include "thermometer.h"
#endif

static simulated chips[SENSOR_CONVERTERS];

typedef struct {
    int is_traced, number;
} wire;

static simulated *chip_at(const wire *one, uint8_t address)
{
    const int k = 2 * one->number + address - 0x2A;

    return address >= 0x2A && address <= 0x2B && k < SENSOR_CONVERTERS ? &chips[k] : NULL;
}

static void others_go_on(const simulated *one)
{
    for (int k = 0; k < SENSOR_CONVERTERS; ++k)
        if (&chips[k] != one)
            simulated_advance(&chips[k], one->time_ns - chips[k].time_ns);
}

static int bus_write(void *context, uint8_t address, const uint8_t *bytes, size_t count)
{
    simulated *chip = chip_at(context, address);
    int error;

    if (((const wire *)context)->is_traced)
        printf("w%02X.%02X=%02X%02X ", address, bytes[0], bytes[1], bytes[2]);
    if (chip == NULL || count != 3)
        return 1;
    error = simulated_write(chip, bytes[0], (uint16_t)(bytes[1] << 8 | bytes[2]));
    others_go_on(chip);
    return error;
}

static int bus_write_read(void *context, uint8_t address, const uint8_t *out, size_t out_count, uint8_t *in, size_t count)
{
    simulated *chip = chip_at(context, address);
    uint16_t value;
    int error;

    if (((const wire *)context)->is_traced)
        printf("r%02X.%02X ", address, out[0]);
    if (chip == NULL || out_count != 1 || count != 2)
        return 1;
    error = simulated_read(chip, out[0], &value);
    others_go_on(chip);
    in[0] = (uint8_t)(value >> 8);
    in[1] = (uint8_t)(value & 0xFF);
    return error;
}

static wire wires[SENSOR_BUSES];
static const ldc161x_bus buses[SENSOR_BUSES] = {
    {&wires[0], bus_write, bus_write_read},
#if SENSOR_BUSES > 1
    {&wires[1], bus_write, bus_write_read},
#endif
};
static const struct {
    int converter, channel;
    double frequency_Hz, ohms;
} tanks[SENSOR_COILS] = SENSOR_TANKS;
static sensor one;
static sensor_reading reading;

#ifdef SENSOR_THERMOMETER
static double celsius;

static float told_celsius(const void *context)
{
    (void)context;
    return (float)celsius;
}
#endif

static void advance(unsigned long long ns)
{
    for (int k = 0; k < SENSOR_CONVERTERS; ++k)
        simulated_advance(&chips[k], ns);
}

static void told(int found)
{
    printf("%d", found);
    for (int k = 0; k < SENSOR_COILS; ++k)
        printf(" %lu %u", (unsigned long)reading.counts[k], (unsigned)reading.status[k]);
    printf("\n");
}

static void test_it(void)
{
    sensor_report report;
    const int wrong = sensor_self_test(&one, &report);

    printf("%d", wrong);
    if (wrong >= 0) {
        printf(" %u %u", (unsigned)report.state, (unsigned)report.told_apart);
        for (int k = 0; k < SENSOR_COILS; ++k)
            printf(" %s %u %d %u", sensor_coil_name(k), (unsigned)report.coil[k], (int)report.inductance[k],
                   (unsigned)report.amplitude[k]);
    }
    printf("\n");
}

static void forces(void)
{
    for (int cell = 0; cell < SENSOR_CELLS; ++cell) {
        float newtons[SENSOR_AXES];

        printf("%s%d", cell == 0 ? "" : " ", sensor_cell_forces(&one, &reading, cell, newtons));
        for (int axis = 0; axis < SENSOR_AXES; ++axis)
            printf(" %.9g", (double)newtons[axis]);
    }
    printf("\n");
}

/* Seconds of readings at so many nanoseconds a poll; glitches every `every` seconds: the worst force, and readings. */
static void watch(double seconds, unsigned long long pause, double every)
{
    const uint64_t end = chips[0].time_ns + (uint64_t)(seconds * 1e9);
    uint64_t next = chips[0].time_ns + (uint64_t)(every * 1e9);
    unsigned long good = 0, bad = 0, glitches = 0;
    float worst = 0.0f;

    while (chips[0].time_ns < end) {
        float newtons[SENSOR_AXES];
        if (every > 0.0 && chips[0].time_ns >= next) {
            chips[0].glitch |= (uint8_t)(1u << glitches % (SENSOR_COILS < 4 ? SENSOR_COILS : 4));
            ++glitches;
            next += (uint64_t)(every * 1e9);
        }
        advance(pause);
        if (sensor_poll(&one, &reading) <= 0)
            continue;
        if (sensor_cell_forces(&one, &reading, 0, newtons) != 0) {
            ++bad;
            continue;
        }
        ++good;
        for (int axis = 0; axis < SENSOR_AXES; ++axis)
            worst = newtons[axis] > worst ? newtons[axis] : -newtons[axis] > worst ? -newtons[axis] : worst;
    }
    printf("%lu %lu %lu %.9g\n", good, bad, glitches, (double)worst);
}

int main(void)
{
    char word[32];
    unsigned k, where, value;
    double first, second;
    unsigned long long ns;

    for (k = 0; k < SENSOR_BUSES; ++k)
        wires[k].number = (int)k;
    for (k = 0; k < SENSOR_CONVERTERS; ++k)
        simulated_start(&chips[k], CHANNELS, CLOCK_HZ, 1.2, k + 1u);
    while (scanf("%31s", word) == 1) {
        if (strcmp(word, "coil") == 0 && scanf("%u %lf %lf", &k, &first, &second) == 3) {
            simulated_coil *const coil = &chips[tanks[k].converter].coil[tanks[k].channel];
            coil->frequency_Hz = first;
            coil->ohms = second;
        } else if (strcmp(word, "advance") == 0 && scanf("%llu", &ns) == 1) {
            advance(ns);
        } else if (strcmp(word, "begin") == 0) {
            const int found = sensor_begin(&one, &buses);
            printf("%d %s\n", found, sensor_text(found));
#ifdef SENSOR_THERMOMETER
            sensor_set_thermometer(&one, told_celsius, NULL);
        } else if (strcmp(word, "celsius") == 0 && scanf("%lf", &celsius) == 1) {
#endif
#ifdef SENSOR_COMPENSATED
        } else if (strcmp(word, "warming") == 0) {
            printf("%.9g\n", (double)sensor_warming(&one, &reading));
#endif
        } else if (strcmp(word, "poll") == 0) {
            const int found = sensor_poll(&one, &reading);
            told(found);
        } else if (strcmp(word, "next") == 0) { /* polls until something is new, at most 10,000 times */
            int found = 0;
            for (k = 0; k < 10000u && found == 0; ++k) {
                advance(100000u);
                found = sensor_poll(&one, &reading);
            }
            told(found);
        } else if (strcmp(word, "settle") == 0 && scanf("%u", &value) == 1) { /* so many scans, polled four times each */
            sensor_reading last;
            int found = 0;
            for (k = 0; k < 4u * value; ++k) {
                advance(SENSOR_SCAN_US * 250ull);
                if (sensor_poll(&one, &last) > 0) {
                    reading = last;
                    found = 1;
                }
            }
            told(found);
        } else if (strcmp(word, "test") == 0) {
            test_it();
        } else if (strcmp(word, "tare") == 0) {
            printf("%d\n", sensor_tare(&one, &reading));
        } else if (strcmp(word, "tares") == 0) {
            printf("%u", (unsigned)one.tares);
            for (k = 0; k < SENSOR_COILS; ++k)
                printf(" %lu", (unsigned long)one.tare[k]);
            printf("\n");
        } else if (strcmp(word, "forces") == 0) {
            forces();
        } else if (strcmp(word, "watch") == 0 && scanf("%lf %llu %lf", &first, &ns, &second) == 3) {
            watch(first, ns, second);
        } else if (strcmp(word, "restarts") == 0) {
            printf("%u\n", (unsigned)one.restarts);
        } else if (strcmp(word, "register") == 0 && scanf("%u %x %x", &k, &where, &value) == 3) {
            chips[k].registers[where] = (uint16_t)value;
        } else if (strcmp(word, "trace") == 0) {
            for (k = 0; k < SENSOR_BUSES; ++k)
                wires[k].is_traced = 1;
        } else if (strcmp(word, "reset") == 0 && scanf("%u", &k) == 1) {
            simulated_reset(&chips[k]);
        } else if (strcmp(word, "nack") == 0 && scanf("%u %u", &k, &value) == 2) {
            chips[k].is_silent = (uint8_t)value;
        } else if (strcmp(word, "stuck") == 0 && scanf("%u %u", &k, &value) == 2) {
            chips[k].stuck = (uint8_t)value;
        } else if (strcmp(word, "glitch") == 0 && scanf("%u %u", &k, &value) == 2) {
            chips[k].glitch = (uint8_t)value;
        } else {
            printf("what? %s\n", word);
            return 1;
        }
    }
    return 0;
}
