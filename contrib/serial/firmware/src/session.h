/* What the program asks for, and what it is answered. */
#ifndef SESSION_H
#define SESSION_H

#include <stdint.h>

/* Says that the board has started, and why (the controller's MCUSR). */
void session_begin(uint8_t cause);

/* Takes what has come, and sends a sample if there is one. */
void session_attend(void);

#endif
