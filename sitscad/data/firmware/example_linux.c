/*
 * A program that reads the sensor on the I2C bus of a Linux computer. It prints a line for each reading: frequencies,
 * states of the coils, forces. `./sensor /dev/i2c-1 -1 lines` prints lines as in sensor_line.h.
 *
 *     cc -std=c99 -O2 -o sensor example_linux.c sensor.c ldc161x.c -lm && ./sensor /dev/i2c-1
 *
 * With two buses (SENSOR_BUSES 2): ./sensor /dev/i2c-1,/dev/i2c-3. If SD of the converters is wired to an output, name
 * its GPIO chip and line: ./sensor /dev/i2c-1 sd=/dev/gpiochip0:17. Without sd=, SD must be wired to GND.
 *
 * Without a board, it runs on simulated converters with the coils of the drawing:
 *
 *     cc -std=c99 -O2 -DSIMULATED -o sensor example_linux.c sensor.c ldc161x.c simulated/simulated.c -lm && ./sensor
 *
 * It begins with the self-test, and then takes the mean of 16 readings as tare. Do not touch the sensor until forces
 * appear.
 */
#if defined(__linux__)

#define _DEFAULT_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "sensor_line.h"
#ifdef SENSOR_THERMOMETER
#include "thermometer.h"
#endif

static int wires[SENSOR_BUSES]; /* handle of each bus: its number, or its file */

#ifdef SIMULATED
#include "simulated/simulated.h"

static simulated chips[SENSOR_CONVERTERS];

static simulated *chip_at(const void *context, uint8_t address)
{
    const uint8_t bus_of[] = SENSOR_BUS_OF, addresses[] = SENSOR_ADDRESSES;

    for (int k = 0; k < SENSOR_CONVERTERS; ++k)
        if (bus_of[k] == *(const int *)context && addresses[k] == address)
            return &chips[k];
    return NULL;
}

static int bus_write(void *context, uint8_t address, const uint8_t *bytes, size_t count)
{
    return chip_at(context, address) == NULL || count != 3u
        || simulated_write(chip_at(context, address), bytes[0], (uint16_t)((unsigned)bytes[1] << 8 | bytes[2]));
}

static int bus_write_read(void *context, uint8_t address, const uint8_t *out, size_t out_count, uint8_t *in,
                          size_t in_count)
{
    uint16_t value = 0u;
    int error;

#ifdef SENSOR_DIGITAL_ADDRESS
    if (address == SENSOR_DIGITAL_ADDRESS) { /* a temperature sensor at 25 degC */
        value = out[0] == SENSOR_DIGITAL_IDENTITY ? SENSOR_DIGITAL_IDENTITY_VALUE
                                                  : (uint16_t)(25.0f / SENSOR_DIGITAL_STEP);
        in[0] = (uint8_t)(value >> 8);
        in[1] = (uint8_t)(value & 0xFFu);
        return 0;
    }
#endif
    error = chip_at(context, address) == NULL || out_count != 1u || in_count != 2u
        || simulated_read(chip_at(context, address), out[0], &value);

    in[0] = (uint8_t)(value >> 8);
    in[1] = (uint8_t)(value & 0xFFu);
    return error;
}

static int opened(int number, const char *path)
{
    static const struct {
        int converter, channel;
        double frequency_Hz, ohms;
    } tanks[SENSOR_COILS] = SENSOR_TANKS;

    (void)path;
    wires[number] = number;
    for (int k = 0; k < SENSOR_CONVERTERS; ++k)
        simulated_start(&chips[k], SENSOR_CHANNELS, SENSOR_CLOCK_HZ, SENSOR_NOISE_STEPS, (uint32_t)(k + 1));
    for (int k = 0; k < SENSOR_COILS; ++k) {
        chips[tanks[k].converter].coil[tanks[k].channel].frequency_Hz = tanks[k].frequency_Hz;
        chips[tanks[k].converter].coil[tanks[k].channel].ohms = tanks[k].ohms;
    }
    return 0;
}

#else
#include <fcntl.h>
#include <linux/gpio.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <sys/ioctl.h>
#include <unistd.h>

static int bus_write(void *context, uint8_t address, const uint8_t *bytes, size_t count)
{
    struct i2c_msg message = {address, 0, (uint16_t)count, (uint8_t *)(uintptr_t)bytes};
    struct i2c_rdwr_ioctl_data both = {&message, 1};

    return ioctl(*(const int *)context, I2C_RDWR, &both) < 0;
}

static int bus_write_read(void *context, uint8_t address, const uint8_t *out, size_t out_count, uint8_t *in,
                          size_t in_count)
{
    struct i2c_msg messages[2] = {{address, 0, (uint16_t)out_count, (uint8_t *)(uintptr_t)out},
                                  {address, I2C_M_RD, (uint16_t)in_count, in}};
    struct i2c_rdwr_ioctl_data both = {messages, 2};

    return ioctl(*(const int *)context, I2C_RDWR, &both) < 0;
}

static int opened(int number, const char *path)
{
    wires[number] = open(path, O_RDWR);
    if (wires[number] < 0)
        perror(path);
    return wires[number] < 0;
}

static void wait_ms(long ms)
{
    const struct timespec pause = {0, ms * 1000000L};

    nanosleep(&pause, NULL);
}

/*
 * Shut the converters down and wake them by the line "CHIP:NUMBER", which is wired to SD. It stays low until the
 * program ends. Returns 0, or 1 if there is no such line.
 */
static int woken(const char *place)
{
    struct gpio_v2_line_request request = {0};
    struct gpio_v2_line_values level = {1u, 1u};
    const char *colon = strrchr(place, ':');
    char path[64];
    int chip;

    if (colon == NULL || (size_t)(colon - place) >= sizeof path) {
        fprintf(stderr, "sd=CHIP:LINE, for example sd=/dev/gpiochip0:17\n");
        return 1;
    }
    memcpy(path, place, (size_t)(colon - place));
    path[colon - place] = '\0';
    request.offsets[0] = (uint32_t)atol(colon + 1);
    request.num_lines = 1u;
    request.config.flags = GPIO_V2_LINE_FLAG_OUTPUT;
    strcpy(request.consumer, "sensor SD");
    chip = open(path, O_RDWR);
    if (chip < 0 || ioctl(chip, GPIO_V2_GET_LINE_IOCTL, &request) < 0
        || ioctl(request.fd, GPIO_V2_LINE_SET_VALUES_IOCTL, &level) < 0) {
        perror(place);
        return 1;
    }
    wait_ms(1L);
    level.bits = 0u;
    if (ioctl(request.fd, GPIO_V2_LINE_SET_VALUES_IOCTL, &level) < 0) {
        perror(place);
        return 1;
    }
    wait_ms(SENSOR_WAKE_MS);
    return 0;
}
#endif

static const ldc161x_bus buses[SENSOR_BUSES] = {
    {&wires[0], bus_write, bus_write_read},
#if SENSOR_BUSES > 1
    {&wires[1], bus_write, bus_write_read},
#endif
};

/* Open every bus. Paths are separated by commas. The text is cut at the commas. */
static int all_opened(char *paths)
{
    for (int k = 0; k < SENSOR_BUSES; ++k) {
        char *end = strchr(paths, ',');
        if (end != NULL)
            *end = '\0';
        if (opened(k, paths) != 0)
            return 1;
        paths = end != NULL ? end + 1 : paths + strlen(paths);
    }
    return 0;
}

/* Print the result of the self-test, one line for each coil. Returns the number of bad coils, or a negative error. */
static int tested(sensor *self)
{
    sensor_report report;
    const int wrong = sensor_self_test(self, &report);

    if (wrong < 0)
        return wrong;
    printf("# %s, %s\n", SENSOR_NAME, report.state == SENSOR_BARE ? "read as a bare board" : "read as assembled");
    for (int k = 0; k < SENSOR_COILS; ++k) {
        printf("# %s: ", sensor_coil_name(k));
        if (report.counts[k] != 0u)
            printf("L %+.1f %% of the design, amplitude %s: ", report.inductance[k] / 10.0,
                   report.amplitude[k] ? "outside of 1.2 to 1.8 V" : "good");
        printf("%s\n", sensor_coil_text(report.coil[k]));
    }
    if (SENSOR_COILS > 1 && !report.told_apart)
        printf("# the coils are too much alike to see whether they are exchanged: press over each and look\n");
#ifndef SITSCAD_AXES
    printf("# %s\n", sensor_text(SENSOR_E_NO_MAP));
#endif
    return wrong;
}

static void sent(const sensor *self, const sensor_reading *reading, int fresh)
{
    static sensor_line line;
    const char *text = sensor_line_next(&line, self, reading, fresh);

    if (text != NULL) {
        printf("%s\n", text);
        fflush(stdout);
    }
}

static void shown(const sensor *self, const sensor_reading *reading)
{
    for (int k = 0; k < SENSOR_COILS; ++k)
        printf("%.1f Hz (%u)  ", (double)reading->frequency_Hz[k], (unsigned)reading->status[k]);
    for (int cell = 0; cell < SENSOR_CELLS; ++cell) {
        float newtons[SENSOR_AXES];
        const int told = sensor_cell_forces(self, reading, cell, newtons);

        if (told == SENSOR_E_NO_MAP)
            continue;
        if (SENSOR_CELLS > 1)
            printf("cell %d: ", cell + 1);
        for (int axis = 0; told >= 0 && axis < SENSOR_AXES; ++axis)
            printf("%+.3f N%s  ", (double)(newtons[axis] * sensor_line_scale(axis)),
                   sensor_line_scale(axis) > 1.0f ? " mm" : "");
        if (told != 0)
            printf("%s  ", told == SENSOR_BEYOND ? "beyond the map" : sensor_text(told));
    }
    printf("\n");
}

/* Remove "sd=..." from the arguments and wake the converters by this line. Returns 0, or 1 if this fails. */
static int take_sd(int *count, char **words)
{
    int left = 1, error = 0;

    for (int k = 1; k < *count; ++k) {
        if (strncmp(words[k], "sd=", 3) != 0)
            words[left++] = words[k];
#ifndef SIMULATED
        else
            error |= woken(words[k] + 3);
#endif
    }
    *count = left;
    return error;
}

int main(int count, char **words)
{
    const int is_asleep = take_sd(&count, words);
    const struct timespec pause = {0, SENSOR_SCAN_US * 250L % 1000000000L};
    const long readings = count > 2 ? atol(words[2]) : -1L; /* endless */
    const int as_lines = count > 3;
    static char usual[] = "/dev/i2c-1";
    static sensor one;
    sensor_reading reading;
    int found;

    if (is_asleep || all_opened(count > 1 ? words[1] : usual) != 0)
        return 1;
    found = sensor_begin(&one, &buses);
#ifdef SENSOR_DIGITAL_ADDRESS
    sensor_set_thermometer(&one, thermometer_celsius, &buses[0]);
#endif
    if (found == 0)
        found = tested(&one);
    if (found < 0) {
        printf("# %s\n", sensor_text(found));
        return 1;
    }
    for (long k = 0; readings < 0 || k < readings;) {
        found = sensor_poll(&one, &reading);
        if (found < 0)
            printf("# %s\n", sensor_text(found));
        if (found > 0 && (one.tares >= 16u || sensor_tare(&one, &reading) != 0)) {
            if (as_lines)
                sent(&one, &reading, found);
            else
                shown(&one, &reading);
            ++k;
        }
        if (found <= 0)
            nanosleep(&pause, NULL);
#ifdef SIMULATED
        for (int each = 0; each < SENSOR_CONVERTERS; ++each)
            simulated_advance(&chips[each], SENSOR_SCAN_US * 250u);
#endif
    }
    return 0;
}

#else
typedef int nothing_for_other_systems;
#endif
