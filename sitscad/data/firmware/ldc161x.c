/* LDC1612 and LDC1614 on a bus: see ldc161x.h. */
#include "ldc161x.h"

int ldc161x_write(const ldc161x_bus *bus, uint8_t address, uint8_t where, uint16_t value)
{
    const uint8_t bytes[3] = {where, (uint8_t)(value >> 8), (uint8_t)(value & 0xFFu)};

    return bus->write(bus->context, address, bytes, sizeof bytes);
}

int ldc161x_read(const ldc161x_bus *bus, uint8_t address, uint8_t where, uint16_t *value)
{
    uint8_t bytes[2] = {0u, 0u};
    const int error = bus->write_read(bus->context, address, &where, 1u, bytes, sizeof bytes);

    *value = (uint16_t)((unsigned)bytes[0] << 8 | bytes[1]);
    return error;
}

int ldc161x_unread(const ldc161x_bus *bus, uint8_t address, uint8_t *unread)
{
    uint16_t status;
    const int error = ldc161x_read(bus, address, LDC161X_STATUS, &status);

    *unread = 0u;
    for (uint8_t channel = 0u; channel < 4u; ++channel)
        if (error == 0 && (status & (8u >> channel)) != 0u)
            *unread = (uint8_t)(*unread | 1u << channel);
    return error;
}

int ldc161x_result(const ldc161x_bus *bus, uint8_t address, uint8_t channel, uint32_t *counts, uint8_t *flags)
{
    uint16_t upper, lower;
    int error = ldc161x_read(bus, address, (uint8_t)(2u * channel), &upper);

    if (error == 0)
        error = ldc161x_read(bus, address, (uint8_t)(2u * channel + 1u), &lower);
    if (error != 0)
        return error;
    *counts = (uint32_t)(upper & 0x0FFFu) << 16 | lower;
    *flags = (uint8_t)(upper >> 12);
    return 0;
}

uint16_t ldc161x_kept(uint8_t where)
{
    /* the converter itself sets INIT_IDRIVE of DRIVE_CURRENT */
    return where >= LDC161X_DRIVE_CURRENT && where < LDC161X_DRIVE_CURRENT + 4u ? 0xF800u : 0xFFFFu;
}
