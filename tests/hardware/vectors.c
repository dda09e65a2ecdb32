/* The file of vectors on standard input, on the simulated converter in C: 0, or the line that it does not keep to. */
#include <stdio.h>
#include <string.h>

#include "simulated/simulated.h"

int main(void)
{
    static simulated chip;
    char text[256], word[16];
    int line = 0, is_refused = 0;

    while (fgets(text, sizeof text, stdin) != NULL) {
        unsigned where = 0, value = 0;
        double first = 0.0, second = 0.0;
        unsigned long long time = 0;
        uint16_t found = 0;
        int error = 0;
        ++line;
        if (sscanf(text, "%15s", word) != 1 || word[0] == '#')
            continue;
        if (strcmp(word, "start") == 0 && sscanf(text, "%*s %u %lf %lf %u", &where, &first, &second, &value) == 4)
            simulated_start(&chip, (uint8_t)where, first, second, value);
        else if (strcmp(word, "tank") == 0 && sscanf(text, "%*s %u %lf %lf", &where, &first, &second) == 3)
            chip.coil[where].frequency_Hz = first, chip.coil[where].ohms = second;
        else if (strcmp(word, "advance") == 0 && sscanf(text, "%*s %llu", &time) == 1)
            simulated_advance(&chip, time);
        else if (strcmp(word, "stuck") == 0 && sscanf(text, "%*s %u", &value) == 1)
            chip.stuck = (uint8_t)value;
        else if (strcmp(word, "glitch") == 0 && sscanf(text, "%*s %u", &value) == 1)
            chip.glitch = (uint8_t)value;
        else if (strcmp(word, "silent") == 0 && sscanf(text, "%*s %u", &value) == 1)
            chip.is_silent = (uint8_t)value;
        else if (strcmp(word, "refused") == 0)
            is_refused = 2;
        else if (strcmp(word, "write") == 0 && sscanf(text, "%*s %x %x", &where, &value) == 2)
            error = simulated_write(&chip, (uint8_t)where, (uint16_t)value);
        else if (strcmp(word, "read") == 0 && sscanf(text, "%*s %x %x", &where, &value) == 2)
            error = simulated_read(&chip, (uint8_t)where, &found);
        else
            return printf("line %d: what?\n", line), 1;
        if ((strcmp(word, "read") == 0 && found != value) || error != (is_refused == 1))
            return printf("line %d: %s: %04X\n", line, text, found), 1;
        is_refused = is_refused == 2 ? 1 : 0;
    }
    return 0;
}
