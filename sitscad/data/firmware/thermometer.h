/*
 * The temperature sensor of the design (readout.thermistor), for sensor_set_thermometer. Functions return degrees
 * Celsius, or NAN if the temperature is not valid.
 *
 * Digital sensor on an I2C bus (buses[0] here), with grounded address pins:
 *     sensor_set_thermometer(&one, thermometer_celsius, &buses[0]);
 *
 * NTC between an analog input and ground, with SENSOR_NTC_SERIES_OHM between the input and the reference voltage of the
 * converter. `ratio` is the reading over its full scale, for example analogRead(A0) / 1023.0f:
 *     static float celsius(const void *context) { (void)context; return thermometer_ntc(ratio()); }
 *     sensor_set_thermometer(&one, celsius, NULL);
 */
#ifndef THERMOMETER_H
#define THERMOMETER_H

#include <math.h>

#include "ldc161x.h"
#include "sensor_config.h"

#define THERMOMETER_LOWEST (-55.0f) /* degC; temperatures beyond these are faults */
#define THERMOMETER_HIGHEST 150.0f

static inline float thermometer_checked(float celsius)
{
    return celsius >= THERMOMETER_LOWEST && celsius <= THERMOMETER_HIGHEST ? celsius : NAN;
}

#ifdef SENSOR_DIGITAL_ADDRESS
/*
 * Temperature by the digital sensor on the bus `context`. NAN if it does not answer, if another part answers, or before
 * its first conversion. Every call reads the identity, so that a hung bus gives no temperature.
 */
static inline float thermometer_celsius(const void *context)
{
    const ldc161x_bus *bus = (const ldc161x_bus *)context;
    uint16_t identity, steps;

    if (ldc161x_read(bus, SENSOR_DIGITAL_ADDRESS, SENSOR_DIGITAL_IDENTITY, &identity) != 0 ||
        (identity & 0x0FFFu) != SENSOR_DIGITAL_IDENTITY_VALUE ||
        ldc161x_read(bus, SENSOR_DIGITAL_ADDRESS, SENSOR_DIGITAL_TEMPERATURE, &steps) != 0)
        return NAN;
    return thermometer_checked((float)(int16_t)steps * SENSOR_DIGITAL_STEP);
}
#endif

#ifdef SENSOR_NTC_OHM
/* Temperature by the NTC from its voltage over the reference voltage. NAN if the NTC is open or shorted. */
static inline float thermometer_ntc(float ratio)
{
    const float relative = SENSOR_NTC_SERIES_OHM / SENSOR_NTC_OHM * ratio / (1.0f - ratio); /* resistance at 25 degC: 1 */

    if (!(ratio > 0.001f && ratio < 0.999f))
        return NAN;
    return thermometer_checked(1.0f / (1.0f / 298.15f + logf(relative) / SENSOR_NTC_B) - 273.15f);
}
#endif

#endif
