#include "uart.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "protocol.h"

#define ROOM 128 /* a power of two */

static uint8_t coming[ROOM], going[ROOM];
static volatile uint8_t coming_end, going_start;
static volatile uint8_t coming_start;
static volatile uint8_t going_end;

void uart_begin(void)
{
    UCSR0A = _BV(U2X0);
    UBRR0 = F_CPU / 8 / BAUD_RATE - 1;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00); /* 8 bits, no parity, 1 stop bit */
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

ISR(USART_RX_vect)
{
    uint8_t next = (coming_end + 1) % ROOM;
    coming[coming_end] = UDR0;
    if (next != coming_start) /* else the byte is lost, and its frame's checksum says so */
        coming_end = next;
}

ISR(USART_UDRE_vect)
{
    UDR0 = going[going_start];
    going_start = (going_start + 1) % ROOM;
    if (going_start == going_end)
        UCSR0B &= ~_BV(UDRIE0);
}

bool uart_has_input(void)
{
    return coming_start != coming_end;
}

bool uart_take(uint8_t *byte)
{
    if (!uart_has_input())
        return false;
    *byte = coming[coming_start];
    coming_start = (coming_start + 1) % ROOM;
    return true;
}

bool uart_send(const uint8_t *bytes, uint8_t length)
{
    uint8_t used = (uint8_t)(going_end - going_start) % ROOM; /* without the cast, negative where the end has wrapped */
    if (length >= ROOM - used)
        return false;
    uint8_t end = going_end;
    while (length--) {
        going[end] = *bytes++;
        end = (end + 1) % ROOM;
    }
    cli();
    going_end = end;
    UCSR0B |= _BV(UDRIE0);
    sei();
    return true;
}
