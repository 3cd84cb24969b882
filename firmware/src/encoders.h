/* Two quadrature encoders, every edge counted (x4); A leads B counts up.
 * 0, the servo: A on D2, B on D3 (external interrupts). 1, the link: A on A0, B on A1 (pin-change interrupt). */
#ifndef ENCODERS_H
#define ENCODERS_H

#include <stdint.h>

#include "protocol.h"

void encoders_begin(void);

/* The counts now; interrupts have to be off, as for encoders_fold. */
void encoders_latch(int32_t counts[ENCODERS]);

/* To be called now and then, for the short counters not to overflow. */
void encoders_fold(void);

void encoders_set(uint8_t encoder, int32_t count);

/* How often both lines of an encoder had changed before its interrupt was served, so that the way was not known. */
uint16_t encoders_missed(void);
void encoders_forget_missed(void);

#endif
