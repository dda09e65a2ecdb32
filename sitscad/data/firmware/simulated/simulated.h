/*
 * A simulated LDC1612 or LDC1614 with coils, register by register as TI's data sheet SNOSCY9A has it: the driver runs on
 * it without a board. Its twin in Python is sitscad.SimulatedConverter; both are held to one file of vectors.
 */
#ifndef SIMULATED_H
#define SIMULATED_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
    double frequency_Hz, ohms; /* the tank's resonance and its R_P; 0 ohm does not oscillate */
} simulated_coil;

typedef struct {
    uint16_t registers[128];
    uint8_t channels;      /* 2: LDC1612, 4: LDC1614 */
    double clock_Hz, noise_steps;
    simulated_coil coil[4];
    uint64_t time_ns, due_ns; /* now; when the conversion ends that goes on */
    uint32_t seed, result[4];
    uint16_t lower[4], held, errors;
    uint8_t flags[4], unread, is_held, is_ready, converting;
    /* faults: bits by channel; a whole converter that does not answer */
    uint8_t stuck, glitch, is_silent;
} simulated;

void simulated_start(simulated *self, uint8_t channels, double clock_Hz, double noise_steps, uint32_t seed);
void simulated_reset(simulated *self); /* power-up and brown-out, too */
void simulated_advance(simulated *self, uint64_t ns);
int simulated_write(simulated *self, uint8_t where, uint16_t value); /* 0; 1 where it does not answer */
int simulated_read(simulated *self, uint8_t where, uint16_t *value);

#endif
