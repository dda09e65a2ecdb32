// As much of Arduino as the sketch asks for, with simulated converters on each bus after its first failure. They answer
// once SD has been low for 2 ms; its pull-up holds it high until an output drives it low. SD_TO_GND: it is wired low.
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>

extern "C" {
#include "chips.h"
}
#include "sensor.h"

static const int HEX = 16;

struct String : std::string {
    String(const char *text) : std::string(text) {}
    String(const std::string &text) : std::string(text) {}
    String(int value) : std::string(std::to_string(value)) {}
    String(unsigned value) : std::string(std::to_string(value)) {}
    String(float value, int digits) : std::string(40, ' ')
    {
        resize(static_cast<size_t>(std::snprintf(&(*this)[0], 40, "%.*f", digits, static_cast<double>(value))));
    }
};

struct Port {
    void begin(long baud) { std::printf("baud %ld\n", baud); }
    void print(const String &text) { std::fputs(text.c_str(), stdout); }
    void println(const String &text) { std::puts(text.c_str()); }
    void println(unsigned value, int) { std::printf("%X\n", value); }
};
static Port Serial;

static const int A0 = 14;
static inline int analogRead(int pin) { return pin == A0 ? 512 : 0; } // an NTC at 25 degC

static const int OUTPUT = 1, LOW = 0, HIGH = 1;
static struct {
    int pin = -1, level = HIGH;
    unsigned low_ms = 0;
} shutdown;

static inline void pinMode(int pin, int) { shutdown.pin = pin; }
static inline void digitalWrite(int pin, int level)
{
    if (pin == shutdown.pin)
        shutdown.level = level;
    shutdown.low_ms = 0;
}
static void delay(unsigned ms) { shutdown.low_ms += ms; }
static bool is_awake()
{
#ifdef SD_TO_GND
    return true;
#else
    return shutdown.level == LOW && shutdown.low_ms >= 2;
#endif
}

#ifndef TRANSFERS_UNTIL_A_FAULT
#define TRANSFERS_UNTIL_A_FAULT 0
#endif
static long transfers = TRANSFERS_UNTIL_A_FAULT;

struct Bus {
    int number;
    simulated *chip = nullptr;
    uint8_t bytes[4];
    size_t count = 0, next = 0;
    bool is_there = false;

    explicit Bus(int given) : number(given) {}
    void begin()
    {
        if (number == 0)
            chips_start();
    }
    void setClock(long) {}
    void beginTransmission(uint8_t address)
    {
        chip = chip_at(number, address);
        count = 0;
    }
    size_t write(const uint8_t *given, size_t many)
    {
        std::memcpy(bytes + count, given, many);
        return count += many;
    }
    uint8_t endTransmission(bool = true)
    {
        if (!is_there) {
            is_there = true;
            return 2;
        }
        if (chip == nullptr || !is_awake() || --transfers == 0)
            return 2;
        if (count == 3)
            simulated_write(chip, bytes[0], static_cast<uint16_t>(bytes[1] << 8 | bytes[2]));
        return 0;
    }
    uint8_t requestFrom(uint8_t, uint8_t many)
    {
        uint16_t value = 0;
        simulated_read(chip, bytes[0], &value);
        bytes[0] = static_cast<uint8_t>(value >> 8);
        bytes[1] = static_cast<uint8_t>(value & 0xFF);
        next = 0;
        return many;
    }
    int read() { return bytes[next++]; }
};
static Bus Wire(0);
#if SENSOR_BUSES > 1
static Bus Wire1(1);
#endif
