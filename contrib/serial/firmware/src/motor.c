#include "motor.h"

#include <avr/io.h>
#include <util/atomic.h>

#include "protocol.h"

#define DIRECTION _BV(PB0)
#define WIDTH _BV(PB1)
#define ENABLE _BV(PB2)
#define LAMP _BV(PB5)

static uint16_t supply;

void motor_begin(void)
{
    motor_off();
    DDRB |= DIRECTION | WIDTH | ENABLE | LAMP;
    ICR1 = MOTOR_STEPS - 1;
    TCCR1A = _BV(WGM11);
    TCCR1B = _BV(WGM13) | _BV(WGM12) | _BV(CS10); /* fast PWM up to ICR1, at the full clock: 16 MHz / 800 */
}

void motor_set_supply(uint16_t millivolts)
{
    motor_off();
    supply = millivolts;
}

bool motor_has_supply(void)
{
    return supply != 0;
}

void motor_set(int16_t millivolts)
{
    uint32_t size = millivolts < 0 ? -(int32_t)millivolts : millivolts;
    uint16_t steps = 0;
    if (supply)
        steps = (uint16_t)((size * MOTOR_STEPS + supply / 2) / supply);
    if (steps > MOTOR_STEPS)
        steps = MOTOR_STEPS;
    if (!steps) { /* the narrowest pulse of this timer is one step wide, not none */
        motor_off();
        return;
    }
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        OCR1A = steps - 1;
        if (millivolts < 0)
            PORTB &= ~DIRECTION;
        else
            PORTB |= DIRECTION;
        TCCR1A |= _BV(COM1A1);
        PORTB |= ENABLE | LAMP;
    }
}

void motor_off(void)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        TCCR1A &= ~_BV(COM1A1);
        PORTB &= ~(DIRECTION | WIDTH | ENABLE | LAMP);
    }
}

bool motor_is_driven(void)
{
    return PORTB & ENABLE;
}
