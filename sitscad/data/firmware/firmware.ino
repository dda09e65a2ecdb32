/*
 * Reads the sensor with an Arduino: this folder is the sketch. Copy calibration.h of your sensor beside it for forces.
 * Serial lines: a header, then sequence, counts, states, newtons, and a CRC of all before the star.
 */
#include <Wire.h>

#include "sensor.h"

static int bus_write(void *, uint8_t address, const uint8_t *bytes, size_t count)
{
    Wire.beginTransmission(address);
    Wire.write(bytes, count);
    return Wire.endTransmission();
}

static int bus_write_read(void *, uint8_t address, const uint8_t *out, size_t out_count, uint8_t *in, size_t in_count)
{
    Wire.beginTransmission(address);
    Wire.write(out, out_count);
    if (Wire.endTransmission(false) != 0 || Wire.requestFrom(address, static_cast<uint8_t>(in_count)) != in_count)
        return 1;
    for (size_t k = 0; k < in_count; ++k)
        in[k] = static_cast<uint8_t>(Wire.read());
    return 0;
}

static const ldc161x_bus bus = {nullptr, bus_write, bus_write_read};
static sensor one;
static uint32_t sequence;
static uint16_t crc; /* CRC-16 CCITT, from 0xFFFF */

static void put(const String &text)
{
    for (unsigned k = 0; k < text.length(); ++k) {
        crc = static_cast<uint16_t>(crc ^ static_cast<uint8_t>(text[k]) << 8);
        for (int bit = 0; bit < 8; ++bit)
            crc = static_cast<uint16_t>(crc & 0x8000u ? crc << 1 ^ 0x1021u : crc << 1);
    }
    Serial.print(text);
}

static void told(int found)
{
    Serial.print("# ");
    Serial.println(sensor_text(found));
}

static void show(const sensor_reading &reading)
{
    float newtons[SENSOR_AXES];
    const int good = sensor_forces(&one, &reading, newtons);

    crc = 0xFFFFu;
    put(String(sequence++));
    for (int k = 0; k < SENSOR_COILS; ++k)
        put("," + String(reading.counts[k]) + "," + String(reading.status[k]));
    for (int axis = 0; axis < SENSOR_AXES; ++axis)
        put("," + (good == 0 ? String(newtons[axis], 4) : String("")));
    Serial.print("*");
    Serial.println(crc, HEX);
}

void setup()
{
    sensor_report report;
    int found;

    Serial.begin(115200);
    Wire.begin();
    Wire.setClock(400000);
    while ((found = sensor_begin(&one, &bus)) != 0) {
        told(found);
        delay(1000);
    }
    sensor_self_test(&one, &report);
    for (int k = 0; k < SENSOR_COILS; ++k) {
        Serial.print("# ");
        Serial.print(sensor_coil_name(k));
        Serial.print(": ");
        Serial.println(sensor_coil_text(report.coil[k]));
    }
    Serial.print("sequence");
    for (int k = 0; k < SENSOR_COILS; ++k) {
        const String name = sensor_coil_name(k);
        Serial.print("," + name + "_counts," + name + "_status");
    }
    for (int axis = 0; axis < SENSOR_AXES; ++axis)
        Serial.print(",axis" + String(axis) + "_N");
    Serial.println("*crc16");
}

void loop()
{
    sensor_reading reading;
    const int found = sensor_poll(&one, &reading);

    if (found < 0) {
        told(found);
        delay(100);
    }
    if (found > 0 && (one.tares >= 16u || sensor_tare(&one, &reading) != 0))
        show(reading);
}
