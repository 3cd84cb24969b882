/* The motor, behind a driver with inputs for pulse width (D9), direction (D8, high for a positive voltage) and enable
 * (D10, high while it is driven). At 0 V all three are low. D13's lamp is on while it is driven. */
#ifndef MOTOR_H
#define MOTOR_H

#include <stdbool.h>
#include <stdint.h>

void motor_begin(void);

/* What the driver is fed with, mV; 0 for not known, and then the motor stands still. */
void motor_set_supply(uint16_t millivolts);
bool motor_has_supply(void);

/* A voltage (mV), to the nearest step of the pulse width, and at most the supply. */
void motor_set(int16_t millivolts);

/* 0 V at once; may be called from an interrupt. */
void motor_off(void);

bool motor_is_driven(void);

#endif
