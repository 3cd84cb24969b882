#include "clock.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "encoders.h"
#include "motor.h"

static volatile uint8_t ticks, flags;
static volatile bool waiting; /* a sample is */
static clock_sample latest;
static uint16_t period, until_sample, next_number;
static volatile uint8_t silence;
static uint16_t timeout, unreloaded;

static void expire(uint8_t why)
{
    motor_off();
    flags |= FLAG_EXPIRED | why;
}

static void latch(void)
{
    encoders_latch(latest.turned);
    latest.number = next_number++;
    until_sample = period;
    waiting = true;
}

/* Each millisecond. The motor is watched here, and not in the main loop: that may hang. */
ISR(TIMER2_COMPA_vect)
{
    ticks++;
    if (silence < SILENCE_MS)
        silence++;
    if (silence == SILENCE_MS && motor_is_driven())
        expire(FLAG_SILENT);
    if (flags & FLAG_WATCHING && !(flags & FLAG_EXPIRED) && ++unreloaded >= timeout)
        expire(0);
    if (flags & FLAG_SAMPLING && !--until_sample)
        latch();
}

void clock_begin(void)
{
    TCCR2A = _BV(WGM21);
    OCR2A = F_CPU / 64 / 1000 - 1;
    TIMSK2 = _BV(OCIE2A);
    TCCR2B = _BV(CS22); /* a 64th of the clock */
}

uint8_t clock_ticks(void)
{
    return ticks;
}

void clock_start(uint16_t milliseconds)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        TCNT2 = 0;
        TIFR2 = _BV(OCF2A);
        period = milliseconds;
        next_number = 0;
        flags |= FLAG_SAMPLING;
        latch();
    }
}

void clock_stop(void)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        flags &= ~FLAG_SAMPLING;
        waiting = false;
    }
}

bool clock_has_sample(void)
{
    return waiting;
}

bool clock_take(clock_sample *sample)
{
    bool taken;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        taken = waiting;
        waiting = false;
        *sample = latest;
    }
    return taken;
}

void clock_heard(void)
{
    silence = 0;
}

void clock_watch(uint16_t milliseconds)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        timeout = milliseconds;
        unreloaded = 0;
        flags |= FLAG_WATCHING;
    }
}

void clock_unwatch(void)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        flags &= ~FLAG_WATCHING;
    }
}

void clock_reload(void)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        unreloaded = 0;
    }
}

void clock_clear(void)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        flags &= ~(FLAG_EXPIRED | FLAG_SILENT);
        unreloaded = 0;
        motor_off();
    }
}

uint8_t clock_flags(void)
{
    return flags;
}
