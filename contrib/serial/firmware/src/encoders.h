/* Two quadrature encoders, every edge counted (x4); A leads B counts up.
 * 0, the servo: A on D2, B on D3 (external interrupts). 1, the link: A on A0, B on A1 (pin-change interrupt). */
#ifndef ENCODERS_H
#define ENCODERS_H

#include <stdint.h>

#include "protocol.h"

void encoders_begin(void);

/* Interrupts count in short numbers that wrap, to be quick. What they are now; interrupts have to be off. */
void encoders_latch(uint16_t turned[ENCODERS]);

/* The counts when those numbers were latched. */
void encoders_counts(const uint16_t turned[ENCODERS], int32_t counts[ENCODERS]);

/* To be called often enough for no number to wrap unseen: each 0.3 s at 100 000 edges a second. */
void encoders_fold(void);

void encoders_set(uint8_t encoder, int32_t count);

/* How often both lines of an encoder had changed before its interrupt was served, so that the way was not known. */
uint16_t encoders_missed(void);
void encoders_forget_missed(void);

#endif
