/*
 * An Arduino sketch that reads the sensor; this folder is the sketch. For forces, copy calibration.h of your sensor
 * into this folder, and temperature.h if there is one. If the sensor has cells, copy the folders cell-1, cell-2, ...,
 * each with these files.
 * The sketch sends the lines of sensor_line.h at SENSOR_BAUD (sensor_config.h) for `sitscad read serial:PORT` and
 * live.html.
 * Three or more converters need a second bus, Wire1.
 */
#include <Wire.h>

#include "sensor_line.h"
#ifdef SENSOR_THERMOMETER
#include "thermometer.h"
#endif

static decltype(Wire) &wire_of(void *context)
{
    return *static_cast<decltype(Wire) *>(context);
}

static int bus_write(void *context, uint8_t address, const uint8_t *bytes, size_t count)
{
    auto &wire = wire_of(context);

    wire.beginTransmission(address);
    wire.write(bytes, count);
    return wire.endTransmission();
}

static int bus_write_read(void *context, uint8_t address, const uint8_t *out, size_t out_count, uint8_t *in,
                          size_t in_count)
{
    auto &wire = wire_of(context);

    wire.beginTransmission(address);
    wire.write(out, out_count);
    if (wire.endTransmission(false) != 0 || wire.requestFrom(address, static_cast<uint8_t>(in_count)) != in_count)
        return 1;
    for (size_t k = 0; k < in_count; ++k)
        in[k] = static_cast<uint8_t>(wire.read());
    return 0;
}

static const ldc161x_bus buses[SENSOR_BUSES] = {
    {&Wire, bus_write, bus_write_read},
#if SENSOR_BUSES > 1
    {&Wire1, bus_write, bus_write_read},
#endif
};
static sensor one;
static sensor_line line;

/* Number of the output that is wired to SD of every converter. -1 if SD is wired to GND. */
#ifndef SENSOR_SD_PIN
#define SENSOR_SD_PIN 4
#endif

/* Shut the converters down and wake them. Their registers then have the values of a power-up. */
static void wake()
{
#if SENSOR_SD_PIN >= 0
    pinMode(SENSOR_SD_PIN, OUTPUT);
    digitalWrite(SENSOR_SD_PIN, HIGH);
    delay(1);
    digitalWrite(SENSOR_SD_PIN, LOW);
#endif
    delay(SENSOR_WAKE_MS);
}

#ifdef SENSOR_NTC_OHM
/* Analog input of the NTC, and the reading at the reference voltage (1023 for 10 bits). */
#ifndef SENSOR_NTC_PIN
#define SENSOR_NTC_PIN A0
#endif
#ifndef SENSOR_NTC_FULL_SCALE
#define SENSOR_NTC_FULL_SCALE 1023.0f
#endif

static float ntc_celsius(const void *)
{
    return thermometer_ntc(static_cast<float>(analogRead(SENSOR_NTC_PIN)) / SENSOR_NTC_FULL_SCALE);
}
#endif

static void told(int found)
{
    Serial.print("# ");
    Serial.println(sensor_text(found));
}

void setup()
{
    sensor_report report;
    int found;

    Serial.begin(SENSOR_BAUD);
    for (const ldc161x_bus &bus : buses) {
        wire_of(bus.context).begin();
        wire_of(bus.context).setClock(400000);
    }
    for (;;) {
        wake();
        found = sensor_begin(&one, &buses);
#if defined(SENSOR_DIGITAL_ADDRESS)
        sensor_set_thermometer(&one, thermometer_celsius, &buses[0]);
#elif defined(SENSOR_NTC_OHM)
        sensor_set_thermometer(&one, ntc_celsius, nullptr);
#endif
        if (found == 0)
            found = sensor_self_test(&one, &report);
        if (found >= 0)
            break;
        told(found);
        delay(1000);
    }
    for (int k = 0; k < SENSOR_COILS; ++k) {
        Serial.print("# ");
        Serial.print(sensor_coil_name(k));
        Serial.print(": ");
        Serial.println(sensor_coil_text(report.coil[k]));
    }
}

void loop()
{
    sensor_reading reading;
    const int found = sensor_poll(&one, &reading);

    if (found < 0) {
        told(found);
        delay(100);
    }
    if (found > 0 && (one.tares >= 16u || sensor_tare(&one, &reading) != 0)) {
        const char *text = sensor_line_next(&line, &one, &reading, found);
        if (text != nullptr)
            Serial.println(text);
    }
}
