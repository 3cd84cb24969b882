/* The line to the program, with a buffer each way. */
#ifndef UART_H
#define UART_H

#include <stdbool.h>
#include <stdint.h>

void uart_begin(void);

bool uart_take(uint8_t *byte);

/* Sends all of it or, where the buffer has no room, none of it: whoever waits for it asks again. */
bool uart_send(const uint8_t *bytes, uint8_t length);

bool uart_has_input(void);

#endif
