#include "encoders.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#define MISSED 2

/* By the lines before (AB) and now (AB); A is the lower bit. */
static const int8_t WAY[16] = {0, 1, -1, MISSED, -1, 0, MISSED, 1, 1, MISSED, 0, -1, MISSED, -1, 1, 0};

static volatile uint16_t turning[ENCODERS];
static uint16_t folded[ENCODERS]; /* what of it is in the total */
static int32_t total[ENCODERS];
static uint8_t before[ENCODERS];
static volatile uint16_t missed;

static inline uint8_t lines(uint8_t encoder)
{
    return encoder ? PINC & 3 : (PIND >> 2) & 3;
}

static inline __attribute__((always_inline)) void edge(uint8_t encoder)
{
    uint8_t now = lines(encoder);
    int8_t way = WAY[before[encoder] | now];
    before[encoder] = (uint8_t)(now << 2);
    if (way == MISSED)
        missed++;
    else
        turning[encoder] += way;
}

ISR(INT0_vect)
{
    edge(0);
}

ISR(INT1_vect, ISR_ALIASOF(INT0_vect));

ISR(PCINT1_vect)
{
    edge(1);
}

void encoders_begin(void)
{
    PORTD |= _BV(PD2) | _BV(PD3); /* pull-ups, for encoders with open collectors */
    PORTC |= _BV(PC0) | _BV(PC1);
    EICRA = _BV(ISC00) | _BV(ISC10); /* any edge */
    EIFR = _BV(INTF0) | _BV(INTF1); /* edges from before are none */
    EIMSK = _BV(INT0) | _BV(INT1);
    PCMSK1 = _BV(PCINT8) | _BV(PCINT9);
    PCICR = _BV(PCIE1);
    for (uint8_t encoder = 0; encoder < ENCODERS; encoder++)
        before[encoder] = (uint8_t)(lines(encoder) << 2);
}

void encoders_latch(uint16_t turned[ENCODERS])
{
    turned[0] = turning[0];
    turned[1] = turning[1];
}

void encoders_counts(const uint16_t turned[ENCODERS], int32_t counts[ENCODERS])
{
    for (uint8_t encoder = 0; encoder < ENCODERS; encoder++)
        counts[encoder] = total[encoder] + (int16_t)(turned[encoder] - folded[encoder]);
}

void encoders_fold(void)
{
    uint16_t now[ENCODERS];
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        encoders_latch(now);
    }
    encoders_counts(now, total);
    folded[0] = now[0];
    folded[1] = now[1];
}

void encoders_set(uint8_t encoder, int32_t count)
{
    encoders_fold();
    total[encoder] = count;
}

uint16_t encoders_missed(void)
{
    uint16_t value;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        value = missed;
    }
    return value;
}

void encoders_forget_missed(void)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        missed = 0;
    }
}
