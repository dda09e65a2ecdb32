/* The simulated converters of one sensor, each on its bus and under its address. */
#pragma once
#include <stddef.h>
#include <stdint.h>

#include "sensor_config.h"
#include "simulated/simulated.h"

static simulated chips[SENSOR_CONVERTERS];

static void chips_start(void)
{
    static const struct {
        int converter, channel;
        double frequency_Hz, ohms;
    } tanks[SENSOR_COILS] = SENSOR_TANKS;

    for (unsigned k = 0; k < SENSOR_CONVERTERS; ++k)
        simulated_start(&chips[k], SENSOR_CHANNELS, SENSOR_CLOCK_HZ, SENSOR_NOISE_STEPS, k + 1u);
    for (int k = 0; k < SENSOR_COILS; ++k) {
        chips[tanks[k].converter].coil[tanks[k].channel].frequency_Hz = tanks[k].frequency_Hz;
        chips[tanks[k].converter].coil[tanks[k].channel].ohms = tanks[k].ohms;
    }
}

/* Nothing where none answers. */
static simulated *chip_at(int bus, unsigned address)
{
    static const uint8_t buses[] = SENSOR_BUS_OF, addresses[] = SENSOR_ADDRESSES;

    for (int k = 0; k < SENSOR_CONVERTERS; ++k)
        if (buses[k] == bus && addresses[k] == address)
            return &chips[k];
    return NULL;
}
