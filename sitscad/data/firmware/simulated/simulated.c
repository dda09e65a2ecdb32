/* The simulated converter of simulated.h. */
#include "simulated.h"

#include <math.h>
#include <string.h>

enum { RCOUNT = 0x08, OFFSET = 0x0C, SETTLECOUNT = 0x10, DIVIDERS = 0x14, STATUS = 0x18, ERROR_CONFIG, CONFIG, MUX_CONFIG,
       RESET_DEV, DRIVE_CURRENT = 0x1E, MANUFACTURER_ID = 0x7E, DEVICE_ID };

enum { READ_NS = 122500, WRITE_NS = 97500, /* at 400 kHz */
       WAKE_NS = 377512,                   /* 16384 periods of the typical 43.4 MHz */
       RECOVERY_NS = 5200000 };            /* after a watchdog timeout */

#define NEVER UINT64_MAX
#define LARGEST 268435455.0

static const double drive_A[32] = {
    16e-6, 18e-6, 20e-6, 23e-6, 28e-6, 32e-6, 40e-6, 46e-6, 52e-6, 59e-6, 72e-6, 82e-6, 95e-6, 110e-6, 127e-6, 146e-6,
    169e-6, 195e-6, 212e-6, 244e-6, 297e-6, 342e-6, 424e-6, 489e-6, 551e-6, 635e-6, 763e-6, 880e-6, 1017e-6, 1173e-6,
    1355e-6, 1563e-6,
};

static unsigned setting(const simulated *self, int first, int channel)
{
    return self->registers[first + channel];
}

static double reference_Hz(const simulated *self, int channel)
{
    return self->clock_Hz / (setting(self, DIVIDERS, channel) & 0x3FFu);
}

static int is_valid(const simulated *self, int channel)
{
    const unsigned dividers = setting(self, DIVIDERS, channel);

    return (dividers & 0x3FFu) != 0u && dividers >> 12 != 0u && setting(self, RCOUNT, channel) > 4u;
}

static int is_scanning(const simulated *self)
{
    return (self->registers[MUX_CONFIG] & 0x8000u) != 0u;
}

static int last_of_scan(const simulated *self)
{
    const int sequence = self->registers[MUX_CONFIG] >> 13 & 3;

    if (!is_scanning(self))
        return self->registers[CONFIG] >> 14;
    return sequence == 3 || self->channels == 2 ? 1 : sequence + 1;
}

static double amplitude_V(const simulated *self, int channel)
{
    return 4.0 * self->coil[channel].ohms * drive_A[setting(self, DRIVE_CURRENT, channel) >> 11] / 3.141592653589793;
}

/* Time of settling and conversion of a channel, and of the watchdog if it does not oscillate (below 0.6 V). */
static uint64_t dwell_ns(const simulated *self, int channel, int is_settling)
{
    const unsigned settle = setting(self, SETTLECOUNT, channel);
    const double periods = (is_settling ? 16.0 * (settle < 2u ? 2u : settle) : 0.0) +
                           16.0 * setting(self, RCOUNT, channel) + 4.0;

    return (uint64_t)(periods * 1e9 / reference_Hz(self, channel)) +
           (amplitude_V(self, channel) < 0.6 ? (uint64_t)RECOVERY_NS : 0u);
}

static void begin(simulated *self, int channel, uint64_t after, int is_settling)
{
    self->converting = (uint8_t)channel;
    self->due_ns = is_valid(self, channel) ? self->time_ns + after + dwell_ns(self, channel, is_settling) : NEVER;
}

static uint32_t drawn(simulated *self)
{
    self->seed ^= self->seed << 13;
    self->seed ^= self->seed >> 17;
    self->seed ^= self->seed << 5;
    return self->seed;
}

/* Approximate normal deviate: the sum of twelve uniform deviates. */
static double normal(simulated *self)
{
    uint32_t sum = 0u;

    for (int k = 0; k < 6; ++k) {
        const uint32_t two = drawn(self);
        sum += (two >> 16) + (two & 0xFFFFu);
    }
    return (sum + 6.0) / 65536.0 - 6.0;
}

static uint32_t converted(simulated *self, int channel)
{
    const double full = (setting(self, DIVIDERS, channel) >> 12) * reference_Hz(self, channel);
    const double count = self->coil[channel].frequency_Hz / full * 268435456.0;
    const double sigma = self->noise_steps / (32.0 * setting(self, RCOUNT, channel));
    double found = count + count * sigma * normal(self) - 4096.0 * setting(self, OFFSET, channel);

    if ((self->glitch >> channel & 1) != 0) {
        const uint32_t which = drawn(self) % 14u; /* near the right value, or far above it */
        self->glitch = (uint8_t)(self->glitch & ~(1u << channel));
        found *= which < 7u ? 1.0 + (which + 1.0) / 256.0 : 1.0 + (which - 6.0) / 5.0;
    }
    found = floor(found + 0.5);
    return found < 0.0 ? 0u : found > LARGEST ? (uint32_t)LARGEST : (uint32_t)found;
}

static void hold(simulated *self)
{
    if (self->is_held == 0u)
        self->held = (uint16_t)(self->errors | (self->is_ready ? 0x40u : 0u) | self->unread);
    self->is_held = 1u;
}

/* End a conversion: store the result and its errors by ERROR_CONFIG, and begin the next channel. */
static void complete(simulated *self)
{
    const int channel = self->converting;
    const double volts = amplitude_V(self, channel);
    const unsigned let = self->registers[ERROR_CONFIG];
    const int is_dead = volts < 0.6;
    uint32_t found = is_dead ? 0u : converted(self, channel);
    unsigned errors = 0u;

    if ((self->stuck >> channel & 1) != 0)
        found = self->result[channel];
    errors |= found == 0u ? 0x8000u : 0u;
    errors |= found == (uint32_t)LARGEST ? 0x4000u : 0u;
    errors |= is_dead ? 0x2000u : 0u;
    errors |= volts > 1.8 ? 0x1000u : 0u;
    errors |= volts < 1.2 ? 0x0800u : 0u;
    self->result[channel] = found;
    self->flags[channel] = (uint8_t)((errors & let & 0xE000u) >> 12 | ((errors & let & 0x1800u) != 0u ? 1u : 0u));
    self->unread = (uint8_t)(self->unread | 8u >> channel);
    errors &= let << 8 & 0xF800u;
    if (self->errors != 0u)
        errors = 0u; /* the first errors stay */
    if (channel == last_of_scan(self) && (let & 1u) != 0u)
        self->is_ready = 1u;
    if (errors != 0u)
        self->errors = (uint16_t)((unsigned)channel << 14 | errors >> 2);
    if (errors != 0u || (channel == last_of_scan(self) && self->is_ready != 0u))
        hold(self);
    {
        const uint64_t pause = 692u + (uint64_t)(5e9 / reference_Hz(self, channel));
        if (!is_scanning(self))
            begin(self, channel, pause, 0);
        else
            begin(self, channel == last_of_scan(self) ? 0 : channel + 1, pause, 1);
    }
}

void simulated_advance(simulated *self, uint64_t ns)
{
    const uint64_t end = self->time_ns + ns;

    while (self->due_ns <= end) {
        self->time_ns = self->due_ns;
        complete(self);
    }
    self->time_ns = end;
}

static void sleep_now(simulated *self)
{
    self->due_ns = NEVER;
    memset(self->result, 0, sizeof self->result);
    memset(self->lower, 0, sizeof self->lower);
    memset(self->flags, 0, sizeof self->flags);
    self->errors = 0u;
    self->unread = self->is_held = self->is_ready = 0u;
}

void simulated_reset(simulated *self)
{
    memset(self->registers, 0, sizeof self->registers);
    for (int channel = 0; channel < self->channels; ++channel)
        self->registers[RCOUNT + channel] = 0x0080u;
    self->registers[CONFIG] = 0x2801u;
    self->registers[MUX_CONFIG] = 0x020Fu;
    self->registers[MANUFACTURER_ID] = 0x5449u;
    self->registers[DEVICE_ID] = 0x3055u;
    sleep_now(self);
}

void simulated_start(simulated *self, uint8_t channels, double clock_Hz, double noise_steps, uint32_t seed)
{
    memset(self, 0, sizeof *self);
    self->channels = channels;
    self->clock_Hz = clock_Hz;
    self->noise_steps = noise_steps;
    self->seed = seed == 0u ? 1u : seed;
    simulated_reset(self);
}

static int is_written(const simulated *self, int where)
{
    const int is_of_channel = (where >= RCOUNT && where < STATUS) || (where >= DRIVE_CURRENT && where < DRIVE_CURRENT + 4);
    const int channel = where >= DRIVE_CURRENT ? where - DRIVE_CURRENT : where & 3;

    if (where == CONFIG)
        return 1;
    if ((self->registers[CONFIG] & 0x2000u) == 0u)
        return 0; /* configuration is not permitted while it converts (8.2.5) */
    return where == ERROR_CONFIG || where == MUX_CONFIG || (is_of_channel && channel < self->channels);
}

int simulated_write(simulated *self, uint8_t where, uint16_t value)
{
    const unsigned before = self->registers[CONFIG];

    simulated_advance(self, WRITE_NS);
    if (self->is_silent != 0u)
        return 1;
    if (where == RESET_DEV && (value & 0x8000u) != 0u) {
        simulated_reset(self);
        return 0;
    }
    if (!is_written(self, where))
        return 0;
    self->registers[where] = where >= DRIVE_CURRENT ? (uint16_t)(value & 0xF800u) : value;
    if (where == CONFIG && (value & 0x2000u) != 0u)
        sleep_now(self);
    else if (where == CONFIG && (before & 0x2000u) != 0u)
        begin(self, is_scanning(self) ? 0 : last_of_scan(self), WAKE_NS, 1);
    return 0;
}

static uint16_t status(simulated *self)
{
    uint16_t found;

    hold(self);
    found = self->held;
    self->errors = 0u;
    self->is_held = self->is_ready = 0u;
    return found;
}

static uint16_t upper(simulated *self, int channel)
{
    const uint16_t found = (uint16_t)((unsigned)self->flags[channel] << 12 | self->result[channel] >> 16);

    self->lower[channel] = (uint16_t)(self->result[channel] & 0xFFFFu);
    self->flags[channel] = 0u;
    self->unread = (uint8_t)(self->unread & ~(8u >> channel));
    if (self->errors >> 14 == channel)
        self->errors = 0u;
    self->is_held = self->is_ready = 0u;
    return found;
}

int simulated_read(simulated *self, uint8_t where, uint16_t *value)
{
    simulated_advance(self, READ_NS);
    *value = 0u;
    if (self->is_silent != 0u)
        return 1;
    if (where == STATUS)
        *value = status(self);
    else if (where < 2 * self->channels)
        *value = (where & 1) != 0 ? self->lower[where / 2] : upper(self, where / 2);
    else if (where < 128)
        *value = self->registers[where];
    return 0;
}
