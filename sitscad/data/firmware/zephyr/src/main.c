/* Reads the sensor under Zephyr: a line a reading on the console. */
#include <zephyr/device.h>
#include <zephyr/drivers/gpio.h>
#include <zephyr/drivers/i2c.h>
#include <zephyr/kernel.h>
#include <zephyr/sys/printk.h>

#include "sensor.h"

static const struct device *const wires[SENSOR_BUSES] = {
    DEVICE_DT_GET(DT_ALIAS(sensor_bus)),
#if SENSOR_BUSES > 1
    DEVICE_DT_GET(DT_ALIAS(second_sensor_bus)),
#endif
};

/* The output that is wired to SD of every converter, as app.overlay names it. None if SD is wired to GND. */
static const struct gpio_dt_spec sd = GPIO_DT_SPEC_GET_OR(DT_PATH(zephyr_user), sd_gpios, {0});

/* Shut the converters down and wake them. */
static void wake(void)
{
    if (sd.port != NULL) {
        (void)gpio_pin_configure_dt(&sd, GPIO_OUTPUT_ACTIVE);
        k_usleep(1000);
        (void)gpio_pin_set_dt(&sd, 0);
    }
    k_usleep(1000 * SENSOR_WAKE_MS);
}

static int bus_write(void *context, uint8_t address, const uint8_t *bytes, size_t count)
{
    return i2c_write(*(const struct device *const *)context, bytes, (uint32_t)count, address);
}

static int bus_write_read(void *context, uint8_t address, const uint8_t *out, size_t out_count, uint8_t *in,
                          size_t in_count)
{
    return i2c_write_read(*(const struct device *const *)context, address, out, out_count, in, in_count);
}

static const ldc161x_bus buses[SENSOR_BUSES] = {
    {(void *)&wires[0], bus_write, bus_write_read},
#if SENSOR_BUSES > 1
    {(void *)&wires[1], bus_write, bus_write_read},
#endif
};

int main(void)
{
    static sensor one;
    sensor_reading reading;
    sensor_report report;
    float newtons[SENSOR_AXES];
    int found = 0;

    for (int k = 0; k < SENSOR_BUSES; ++k)
        if (!device_is_ready(wires[k]))
            found = SENSOR_E_BUS;
    wake();
    if (found == 0)
        found = sensor_begin(&one, &buses);
    if (found == 0)
        found = sensor_self_test(&one, &report);
    if (found < 0) {
        printk("%s\n", sensor_text(found));
        return 0;
    }
    for (int k = 0; k < SENSOR_COILS; ++k)
        printk("%s: %s\n", sensor_coil_name(k), sensor_coil_text(report.coil[k]));
    for (;;) {
        found = sensor_poll(&one, &reading);
        if (found < 0)
            printk("%s\n", sensor_text(found));
        if (found > 0 && one.tares < 16u) {
            (void)sensor_tare(&one, &reading);
        } else if (found > 0 && sensor_forces(&one, &reading, newtons) == 0) {
            for (int axis = 0; axis < SENSOR_AXES; ++axis)
                printk("%d mN ", (int)(1000.0f * newtons[axis]));
            printk("\n");
        }
        if (found <= 0)
            k_usleep(SENSOR_SCAN_US / 4u);
    }
}
