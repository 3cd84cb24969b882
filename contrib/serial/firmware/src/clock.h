/* The board's own time, in milliseconds: when samples are taken, and when the motor is set to 0 V. */
#ifndef CLOCK_H
#define CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol.h"

typedef struct {
    uint16_t number; /* from the start of sampling */
    uint16_t turned[ENCODERS];
} clock_sample;

void clock_begin(void);

/* Changes with each millisecond. */
uint8_t clock_ticks(void);

/* Samples at once, and again whenever so many milliseconds have passed. */
void clock_start(uint16_t period);
void clock_stop(void);

/* Gives a sample that has not been fetched, if there is one. */
bool clock_take(clock_sample *sample);
bool clock_has_sample(void);

/* Something was heard from the program. */
void clock_heard(void);

void clock_watch(uint16_t timeout);
void clock_unwatch(void);
void clock_reload(void);
void clock_clear(void);

/* FLAG_EXPIRED, FLAG_SILENT, FLAG_WATCHING and FLAG_SAMPLING, as they are. */
uint8_t clock_flags(void);

#endif
