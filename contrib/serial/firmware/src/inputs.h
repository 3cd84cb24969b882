/* Two analog inputs (A2, A3: 0 to 5 V in 1024 steps), measured in turn, and four digital outputs (D4 to D7). */
#ifndef INPUTS_H
#define INPUTS_H

#include <stdint.h>

#include "protocol.h"

void inputs_begin(void);

/* Fetches a result that is there, and begins to measure the other input. */
void inputs_attend(void);

uint16_t inputs_analog(uint8_t input);

void inputs_set_lines(uint8_t mask, uint8_t levels);
uint8_t inputs_lines(void);

#endif
