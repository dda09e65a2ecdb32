/* A simulated converter of one sensor behind the calls of Linux' i2c-dev, or of Zephyr: what its examples make of it. */
#define _DEFAULT_SOURCE
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "sensor_config.h"
#include "simulated/simulated.h"

static simulated chip;

static int started(void)
{
    static const struct {
        int converter, channel;
        double frequency_Hz, ohms;
    } tanks[SENSOR_COILS] = SENSOR_TANKS;

    simulated_start(&chip, SENSOR_CHANNELS, SENSOR_CLOCK_HZ, SENSOR_NOISE_STEPS, 1u);
    for (int k = 0; k < SENSOR_COILS; ++k) {
        chip.coil[k].frequency_Hz = tanks[k].frequency_Hz;
        chip.coil[k].ohms = tanks[k].ohms;
    }
    return 1;
}

static int moved(unsigned address, const uint8_t *out, size_t out_count, uint8_t *in, size_t in_count)
{
    uint16_t value = 0u;
    int error;

    if (address != 0x2Au)
        return -1;
    if (in == NULL)
        return out_count != 3u || simulated_write(&chip, out[0], (uint16_t)((unsigned)out[1] << 8 | out[2])) != 0 ? -1 : 0;
    error = out_count != 1u || in_count != 2u || simulated_read(&chip, out[0], &value) != 0;
    in[0] = (uint8_t)(value >> 8);
    in[1] = (uint8_t)(value & 0xFFu);
    return error ? -1 : 0;
}

#ifdef ZEPHYR_STUB
#include <zephyr/drivers/i2c.h>
#include <zephyr/kernel.h>

const struct device bus_of_the_board;

bool device_is_ready(const struct device *bus)
{
    return bus == &bus_of_the_board && started();
}

int i2c_write(const struct device *bus, const uint8_t *bytes, uint32_t count, uint16_t address)
{
    (void)bus;
    return moved(address, bytes, count, NULL, 0u);
}

int i2c_write_read(const struct device *bus, uint16_t address, const void *out, size_t out_count, void *in, size_t count)
{
    (void)bus;
    return moved(address, out, out_count, in, count);
}

int32_t k_usleep(int32_t us)
{
    static int times;

    simulated_advance(&chip, (uint64_t)us * 1000u);
    if (++times > 100)
        exit(0); /* it reads for ever */
    return 0;
}
#else
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <time.h>

int bus_open(const char *path, int flags, ...);
int bus_ioctl(int device, unsigned long request, ...);
int bus_sleep(const struct timespec *pause, struct timespec *left);

int bus_open(const char *path, int flags, ...)
{
    (void)flags;
    return strcmp(path, "/dev/i2c-1") == 0 && started() ? 7 : -1;
}

int bus_ioctl(int device, unsigned long request, ...)
{
    const struct i2c_rdwr_ioctl_data *both;
    const struct i2c_msg *one;
    va_list given;

    va_start(given, request);
    both = va_arg(given, const struct i2c_rdwr_ioctl_data *);
    va_end(given);
    one = both->msgs;
    if (device != 7 || request != I2C_RDWR || (one[0].flags & I2C_M_RD) != 0)
        return -1;
    if (both->nmsgs == 1u)
        return moved(one[0].addr, one[0].buf, one[0].len, NULL, 0u);
    if (one[1].addr != one[0].addr || (one[1].flags & I2C_M_RD) == 0)
        return -1;
    return moved(one[0].addr, one[0].buf, one[0].len, one[1].buf, one[1].len);
}

int bus_sleep(const struct timespec *pause, struct timespec *left)
{
    (void)left;
    simulated_advance(&chip, (uint64_t)pause->tv_nsec);
    return 0;
}
#endif
