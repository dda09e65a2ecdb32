/*
 * A simulated converter of one sensor behind the calls of Linux' i2c-dev and GPIO: what its example makes of it.
 * It answers once SD has been low for 2 ms. SD_PULLED_UP: a resistor holds it high until an output drives it low.
 */
#define _DEFAULT_SOURCE
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "chips.h"

#ifdef SD_PULLED_UP
static int sd_level = 1;
#else
static int sd_level;
#endif
static uint64_t low_ns = 2000000u;

static void drive_sd(int level)
{
    sd_level = level;
    low_ns = 0u;
}

static int moved(int bus, unsigned address, const uint8_t *out, size_t out_count, uint8_t *in, size_t in_count)
{
    simulated *chip = chip_at(bus, address);
    uint16_t value = 0u;
    int error;

    if (chip == NULL || sd_level != 0 || low_ns < 2000000u)
        return -1;
    if (in == NULL)
        return out_count != 3u || simulated_write(chip, out[0], (uint16_t)((unsigned)out[1] << 8 | out[2])) != 0 ? -1 : 0;
    error = out_count != 1u || in_count != 2u || simulated_read(chip, out[0], &value) != 0;
    in[0] = (uint8_t)(value >> 8);
    in[1] = (uint8_t)(value & 0xFFu);
    return error ? -1 : 0;
}

static void waited(uint64_t ns)
{
    low_ns += ns;
    for (int k = 0; k < SENSOR_CONVERTERS; ++k)
        simulated_advance(&chips[k], ns);
}

#include <linux/gpio.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <time.h>

int bus_open(const char *path, int flags, ...);
int bus_ioctl(int device, unsigned long request, ...);
int bus_sleep(const struct timespec *pause, struct timespec *left);

int bus_open(const char *path, int flags, ...)
{
    (void)flags;
    if (strcmp(path, "/dev/gpiochip0") == 0)
        return 8;
    if (strcmp(path, "/dev/i2c-1") != 0)
        return -1;
    chips_start();
    return 7;
}

int bus_ioctl(int device, unsigned long request, ...)
{
    const struct i2c_rdwr_ioctl_data *both;
    const struct i2c_msg *one;
    void *argument;
    va_list given;

    va_start(given, request);
    argument = va_arg(given, void *);
    va_end(given);
    if (device == 8 && request == GPIO_V2_GET_LINE_IOCTL) {
        struct gpio_v2_line_request *asked = argument;
        asked->fd = asked->offsets[0] == 17u && asked->config.flags == GPIO_V2_LINE_FLAG_OUTPUT ? 9 : -1;
        return asked->fd < 0 ? -1 : 0;
    }
    if (device == 9 && request == GPIO_V2_LINE_SET_VALUES_IOCTL) {
        drive_sd((((struct gpio_v2_line_values *)argument)->bits & 1u) != 0u);
        return 0;
    }
    both = argument;
    one = both->msgs;
    if (device != 7 || request != I2C_RDWR || (one[0].flags & I2C_M_RD) != 0)
        return -1;
    if (both->nmsgs == 1u)
        return moved(0, one[0].addr, one[0].buf, one[0].len, NULL, 0u);
    if (one[1].addr != one[0].addr || (one[1].flags & I2C_M_RD) == 0)
        return -1;
    return moved(0, one[0].addr, one[0].buf, one[0].len, one[1].buf, one[1].len);
}

int bus_sleep(const struct timespec *pause, struct timespec *left)
{
    (void)left;
    waited((uint64_t)pause->tv_nsec);
    return 0;
}
