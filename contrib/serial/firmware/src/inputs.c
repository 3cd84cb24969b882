#include "inputs.h"

#include <avr/io.h>

#define FIRST_INPUT 2
#define FIRST_LINE 4
#define REFERENCE _BV(REFS0) /* the 5 V that the board is fed with */

static uint16_t measured[ANALOG_INPUTS];
static uint8_t input;

static void measure(void)
{
    ADMUX = REFERENCE | (FIRST_INPUT + input);
    ADCSRA |= _BV(ADSC);
}

void inputs_begin(void)
{
    DDRD |= 0xf0;
    ADCSRA = _BV(ADEN) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0); /* 125 kHz */
    measure();
}

void inputs_attend(void)
{
    if (ADCSRA & _BV(ADSC))
        return;
    measured[input] = ADC;
    input = (input + 1) % ANALOG_INPUTS;
    measure();
}

uint16_t inputs_analog(uint8_t which)
{
    return measured[which];
}

void inputs_set_lines(uint8_t mask, uint8_t levels)
{
    PORTD = (PORTD & ~(mask << FIRST_LINE)) | ((mask & levels) << FIRST_LINE);
}

uint8_t inputs_lines(void)
{
    return PORTD >> FIRST_LINE;
}
