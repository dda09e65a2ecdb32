/*
 * Registers of LDC1612 and LDC1614, with functions that write and read them (TI data sheet SNOSCY9A, 7.5 and 7.6).
 * C99 without heap, delays, libraries and floating-point numbers.
 */
#ifndef LDC161X_H
#define LDC161X_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The I2C bus, with 7-bit addresses. Functions return 0, or an error. write_read uses a repeated start. */
typedef struct {
    void *context;
    int (*write)(void *context, uint8_t address, const uint8_t *bytes, size_t count);
    int (*write_read)(void *context, uint8_t address, const uint8_t *out, size_t out_count, uint8_t *in,
                      size_t in_count);
} ldc161x_bus;

#define LDC161X_STATUS 0x18u
#define LDC161X_ERROR_CONFIG 0x19u
#define LDC161X_CONFIG 0x1Au
#define LDC161X_RESET_DEV 0x1Cu
#define LDC161X_DRIVE_CURRENT 0x1Eu /* of channel 0 */
#define LDC161X_MANUFACTURER_ID 0x7Eu
#define LDC161X_DEVICE_ID 0x7Fu

#define LDC161X_RESET 0x8000u        /* in RESET_DEV */
#define LDC161X_MANUFACTURER 0x5449u /* value of MANUFACTURER_ID */
#define LDC161X_DEVICE 0x3055u       /* value of DEVICE_ID for both parts */

/* Flags in the upper register of a result. ERROR_CONFIG enables them. */
#define LDC161X_UNDER_RANGE 0x8u
#define LDC161X_OVER_RANGE 0x4u
#define LDC161X_WATCHDOG 0x2u
#define LDC161X_AMPLITUDE 0x1u

#define LDC161X_LARGEST 0x0FFFFFFFul /* result of a conversion over the range; 0: under the range */

/* All functions return 0, or the error of the bus. */
int ldc161x_write(const ldc161x_bus *bus, uint8_t address, uint8_t where, uint16_t value);
int ldc161x_read(const ldc161x_bus *bus, uint8_t address, uint8_t where, uint16_t *value);

/* Read STATUS, which clears it. Bit n of *unread is 1 if channel n has an unread result. */
int ldc161x_unread(const ldc161x_bus *bus, uint8_t address, uint8_t *unread);

/* Read the result of a channel. The upper register comes first and locks the lower one; both reads clear. */
int ldc161x_result(const ldc161x_bus *bus, uint8_t address, uint8_t channel, uint32_t *counts, uint8_t *flags);

/* Return the bits of a register that can be read back. */
uint16_t ldc161x_kept(uint8_t where);

#ifdef __cplusplus
}
#endif

#endif
