/* An Arduino Uno in simavr, with what the tests need at its pins. Called by simulated_uno.py. */
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

#define ENCODERS 2
#define ROOM 65536
#define BYTE_TIME 320 /* cycles: 10 bits at 500 kbaud */

/* Addresses of the ATmega328P's registers. */
enum { PINC = 0x26, PIND = 0x29, DDRD = 0x2a, PORTD = 0x2b, DDRB = 0x24, PORTB = 0x25, TCCR1A = 0x80, ICR1L = 0x86, OCR1AL = 0x88 };

typedef struct encoder {
    struct uno *uno;
    char port;
    int pin; /* of A; B is the next */
    int32_t at, target;
    avr_cycle_count_t step;
} encoder;

typedef struct uno {
    avr_t *avr;
    encoder encoders[ENCODERS];
    uint8_t coming[ROOM], going[ROOM];
    avr_cycle_count_t came_at[ROOM]; /* when the byte was whole on the line */
    uint32_t coming_start, coming_end, going_start, going_end;
    bool feeding;
    uint32_t hung_at;
    uint8_t hung_was[2];
} uno;

static void no_sleep(avr_t *avr, avr_cycle_count_t cycles)
{
    (void)avr, (void)cycles; /* time is simulated: nobody waits for it */
}

static void silent(avr_t *avr, const int level, const char *format, va_list arguments)
{
    (void)avr, (void)level, (void)format, (void)arguments;
}

static void show(encoder *shown)
{
    /* Both lines are high at 0: of one that is low before the firmware has chosen edges, simavr makes an interrupt
     * that never ends. */
    int state = (shown->at + 2) & 3, a = state == 1 || state == 2, b = state >= 2;
    avr_t *avr = shown->uno->avr;
    /* For simavr an input with a pull-up is high, unless it is told what drives it. */
    avr_ioport_external_t driven = {.name = shown->port, .mask = 3 << shown->pin, .value = (a | b << 1) << shown->pin};
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(shown->port), &driven);
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(shown->port), shown->pin), a);
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(shown->port), shown->pin + 1), b);
}

static avr_cycle_count_t edge(avr_t *avr, avr_cycle_count_t when, void *parameter)
{
    encoder *turned = parameter;
    (void)avr;
    if (turned->at == turned->target)
        return 0;
    turned->at += turned->at < turned->target ? 1 : -1;
    show(turned);
    return turned->at == turned->target ? 0 : when + turned->step;
}

static avr_cycle_count_t next_byte(avr_t *avr, avr_cycle_count_t when, void *parameter)
{
    uno *board = parameter;
    if (board->coming_start == board->coming_end) {
        board->feeding = false;
        return 0;
    }
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT),
                  board->coming[board->coming_start++ % ROOM]);
    return when + BYTE_TIME;
}

static void sent(struct avr_irq_t *irq, uint32_t value, void *parameter)
{
    uno *board = parameter;
    (void)irq;
    board->came_at[board->going_end % ROOM] = board->avr->cycle + BYTE_TIME;
    board->going[board->going_end++ % ROOM] = (uint8_t)value;
}

uno *uno_open(const char *firmware)
{
    elf_firmware_t loaded;
    memset(&loaded, 0, sizeof loaded);
    avr_global_logger_set(silent);
    if (elf_read_firmware(firmware, &loaded))
        return NULL;
    loaded.frequency = 16000000;
    strcpy(loaded.mmcu, "atmega328p");
    uno *board = calloc(1, sizeof *board);
    board->avr = avr_make_mcu_by_name(loaded.mmcu);
    if (!board->avr)
        return NULL;
    avr_init(board->avr);
    board->avr->sleep = no_sleep;
    avr_load_firmware(board->avr, &loaded);
    uint32_t flags = 0;
    avr_ioctl(board->avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(board->avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), sent, board);
    board->avr->vcc = board->avr->avcc = board->avr->aref = 5000;
    board->encoders[0] = (encoder){.uno = board, .port = 'D', .pin = 2};
    board->encoders[1] = (encoder){.uno = board, .port = 'C', .pin = 0};
    for (int which = 0; which < ENCODERS; which++)
        show(&board->encoders[which]);
    return board;
}

void uno_close(uno *board)
{
    avr_terminate(board->avr);
    free(board);
}

uint64_t uno_now(uno *board)
{
    return board->avr->cycle;
}

/* Puts bytes on the line to the board; they come one after the other. */
void uno_feed(uno *board, const uint8_t *bytes, uint32_t length)
{
    for (uint32_t at = 0; at < length; at++)
        board->coming[board->coming_end++ % ROOM] = bytes[at];
    if (length && !board->feeding) {
        board->feeding = true;
        avr_cycle_timer_register(board->avr, BYTE_TIME, next_byte, board);
    }
}

/* Fetches what has come whole from the board. */
uint32_t uno_take(uno *board, uint8_t *bytes, uint32_t room)
{
    uint32_t length = 0;
    while (length < room && board->going_start != board->going_end &&
           board->came_at[board->going_start % ROOM] <= board->avr->cycle)
        bytes[length++] = board->going[board->going_start++ % ROOM];
    return length;
}

/* Turns an encoder to a position (counts), evenly over so many cycles from now. */
void uno_turn(uno *board, int which, int32_t target, uint64_t cycles)
{
    encoder *turned = &board->encoders[which];
    uint32_t edges = (uint32_t)abs(target - turned->at);
    turned->target = target;
    avr_cycle_timer_cancel(board->avr, edge, turned);
    if (!edges)
        return;
    turned->step = cycles / edges;
    avr_cycle_timer_register(board->avr, turned->step / 2 + 1, edge, turned);
}

static avr_cycle_count_t nothing(avr_t *avr, avr_cycle_count_t when, void *parameter)
{
    (void)avr, (void)when, (void)parameter;
    return 0; /* only that no sleep lasts longer */
}

/* Runs until a time (cycles). False, if the controller has stopped. */
bool uno_run(uno *board, uint64_t until)
{
    avr_t *avr = board->avr;
    if (avr->cycle >= until)
        return true;
    avr_cycle_timer_cancel(avr, nothing, board);
    avr_cycle_timer_register(avr, until - avr->cycle, nothing, board);
    while (avr->cycle < until) {
        int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed)
            return false;
    }
    return true;
}

/* What the motor gets of its supply, -1 to 1: what pins D8, D9 and D10 make of it. */
double uno_duty(uno *board)
{
    const uint8_t *data = board->avr->data;
    const int direction = 1 << 0, width = 1 << 1, enable = 1 << 2, all = direction | width | enable;
    if ((data[DDRB] & all) != all || !(data[PORTB] & enable))
        return 0.0;
    double duty = data[PORTB] & width ? 1.0 : 0.0;
    if (data[TCCR1A] & 0x80) {
        int compare = data[OCR1AL] | data[OCR1AL + 1] << 8, top = data[ICR1L] | data[ICR1L + 1] << 8;
        duty = (compare + 1.0) / (top + 1.0);
    }
    return data[PORTB] & direction ? duty : -duty;
}

/* The levels of port D's pins 4 to 7. */
int uno_lines(uno *board)
{
    return (board->avr->data[PORTD] & board->avr->data[DDRD]) >> 4;
}

void uno_analog(uno *board, int input, uint32_t millivolts)
{
    avr_raise_irq(avr_io_getirq(board->avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + input), millivolts);
}

/* The reset button. */
void uno_reset(uno *board)
{
    uint8_t *data = board->avr->data, pin_c = data[PINC], pin_d = data[PIND];
    avr_reset(board->avr);
    data[PINC] = pin_c, data[PIND] = pin_d; /* what is wired to the pins stays */
}

/* The program hangs where it is, with interrupts or without. */
void uno_hang(uno *board, bool interrupts)
{
    avr_t *avr = board->avr;
    while (avr->state != cpu_Running || !avr->sreg[S_I])
        avr_run(avr);
    board->hung_at = avr->pc;
    memcpy(board->hung_was, avr->flash + avr->pc, sizeof board->hung_was);
    avr->flash[avr->pc] = 0xff, avr->flash[avr->pc + 1] = 0xcf; /* rjmp to itself */
    avr->sreg[S_I] = interrupts;
}

/* The program would not hang there again. */
void uno_mend(uno *board)
{
    memcpy(board->avr->flash + board->hung_at, board->hung_was, sizeof board->hung_was);
}
