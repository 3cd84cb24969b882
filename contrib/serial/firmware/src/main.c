/* A bench of one's own: two encoders and a motor on an Arduino Uno (ATmega328P, 16 MHz). See README.md. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "clock.h"
#include "encoders.h"
#include "inputs.h"
#include "motor.h"
#include "session.h"
#include "uart.h"

static uint8_t reset_cause __attribute__((section(".noinit")));

/* After the controller's own watchdog has started it anew, that goes on running, at its shortest: it is stopped first. */
void before_main(void) __attribute__((naked, used, section(".init3")));
void before_main(void)
{
    reset_cause = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

static void sleep_until_interrupt(void)
{
    cli();
    if (!uart_has_input() && !clock_has_sample()) {
        sleep_enable();
        sei(); /* takes effect after the next instruction: nothing comes in between */
        sleep_cpu();
        sleep_disable();
    }
    sei();
}

int main(void)
{
    motor_begin();
    encoders_begin();
    inputs_begin();
    uart_begin();
    clock_begin();
    set_sleep_mode(SLEEP_MODE_IDLE);
    wdt_enable(WDTO_60MS);
    sei();
    session_begin(reset_cause);
    uint8_t last_tick = clock_ticks();
    for (;;) {
        uint8_t tick = clock_ticks();
        if (tick != last_tick) { /* this loop runs, and so does the clock */
            wdt_reset();
            last_tick = tick;
        }
        encoders_fold();
        inputs_attend();
        session_attend();
        sleep_until_interrupt();
    }
}
