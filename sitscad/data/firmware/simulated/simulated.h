/*
 * A simulated LDC1612 or LDC1614 with coils, register by register (TI data sheet SNOSCY9A). The driver runs on it
 * without a board. sitscad.SimulatedConverter in Python gives the same results; one file of vectors tests both.
 */
#ifndef SIMULATED_H
#define SIMULATED_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
    double frequency_Hz, ohms; /* resonance and R_P of the tank; 0 ohm: no oscillation */
} simulated_coil;

typedef struct {
    uint16_t registers[128];
    uint8_t channels;      /* 2: LDC1612, 4: LDC1614 */
    double clock_Hz, noise_steps;
    simulated_coil coil[4];
    uint64_t time_ns, due_ns; /* present time; end of the present conversion */
    uint32_t seed, result[4];
    uint16_t lower[4], held, errors;
    uint8_t flags[4], unread, is_held, is_ready, converting;
    /* faults: a bit for each channel; or no answer of the whole converter */
    uint8_t stuck, glitch, is_silent;
} simulated;

void simulated_start(simulated *self, uint8_t channels, double clock_Hz, double noise_steps, uint32_t seed);
void simulated_reset(simulated *self); /* also for power-up and brown-out */
void simulated_advance(simulated *self, uint64_t ns);
int simulated_write(simulated *self, uint8_t where, uint16_t value); /* 0, or 1 if it does not answer */
int simulated_read(simulated *self, uint8_t where, uint16_t *value);

#endif
