#include "session.h"

#include <stdbool.h>
#include <string.h>
#include <util/atomic.h>

#include "clock.h"
#include "encoders.h"
#include "frame.h"
#include "inputs.h"
#include "motor.h"
#include "protocol.h"
#include "uart.h"

typedef struct __attribute__((packed)) {
    uint8_t head;
    union {
        struct __attribute__((packed)) {
            uint16_t number;
            int32_t counts[ENCODERS];
            uint8_t flags, accepted, lines;
            uint16_t analog[ANALOG_INPUTS];
        } sample;
        struct __attribute__((packed)) {
            uint8_t sequence, to, status, flags, accepted;
            union {
                struct __attribute__((packed)) {
                    uint8_t release;
                    uint16_t steps;
                    uint8_t silence, cause;
                } hello;
                struct __attribute__((packed)) {
                    int32_t counts[ENCODERS];
                    uint8_t lines;
                    uint16_t analog[ANALOG_INPUTS], damaged, lost, missed;
                } read;
            };
        } reply;
        uint8_t cause;
    };
} answer;

typedef struct __attribute__((packed)) {
    uint8_t head, sequence;
    union {
        int16_t millivolts;
        struct __attribute__((packed)) {
            uint8_t mask;
            int32_t counts[ENCODERS];
        } counts;
        uint16_t period, supply;
        struct __attribute__((packed)) {
            uint8_t operation;
            uint16_t timeout;
        } watchdog;
        struct __attribute__((packed)) {
            uint8_t mask, levels;
        } lines;
    };
} request;

_Static_assert(sizeof(answer) <= FRAME_BODY && sizeof(request) <= FRAME_BODY, "a frame has no room for that");

#define HEAD(type) (uint8_t)(PROTOCOL_VERSION << 4 | (type))
#define LENGTH(field) (sizeof(((request *)0)->field) + 2)
#define REPLY_LENGTH 6

static const uint8_t LENGTHS[16] = {
    [HELLO] = 2, [BYE] = 2, [RELOAD] = 2, [READ] = 2, [STOP] = 2, [ALIVE] = 2,
    [OUTPUT] = LENGTH(millivolts), [COUNTS] = LENGTH(counts), [START] = LENGTH(period),
    [WATCHDOG] = LENGTH(watchdog), [LINES] = LENGTH(lines), [SUPPLY] = LENGTH(supply),
};

static frame_receiver receiver;
static bool in_session;
static uint8_t reset_cause;
static uint8_t expected; /* sequence number of the next frame */
static uint8_t accepted; /* that of the OUTPUT that was obeyed last */
static uint16_t lost;

static uint8_t all_flags(void)
{
    uint8_t flags = clock_flags();
    if (encoders_missed())
        flags |= FLAG_MISCOUNTED;
    if (receiver.damaged || lost)
        flags |= FLAG_DAMAGED;
    if (in_session)
        flags |= FLAG_SESSION;
    return flags;
}

static void transmit(const answer *said, uint8_t length)
{
    uint8_t packed[FRAME_PACKED];
    uart_send(packed, frame_pack((const uint8_t *)said, length, packed));
}

static void rest(void)
{
    clock_stop();
    clock_unwatch();
    clock_clear();
    motor_set_supply(0);
    inputs_set_lines(0xff, 0);
}

static void set_output(int16_t millivolts, uint8_t sequence)
{
    if (clock_flags() & FLAG_EXPIRED)
        return;
    motor_set(millivolts);
    if (clock_flags() & FLAG_EXPIRED) /* meanwhile */
        motor_off();
    else
        accepted = sequence;
}

static uint8_t watchdog(uint8_t operation, uint16_t timeout)
{
    if (operation == WATCH && timeout)
        clock_watch(timeout);
    else if (operation == UNWATCH)
        clock_unwatch();
    else if (operation == CLEAR)
        clock_clear();
    else
        return BAD_VALUE;
    return OK;
}

/* Does what a request says. */
static uint8_t obey(uint8_t type, const request *asked)
{
    switch (type) {
    case BYE:
        rest();
        in_session = false;
        return OK;
    case READ:
        return OK;
    case COUNTS:
        for (uint8_t encoder = 0; encoder < ENCODERS; encoder++)
            if (asked->counts.mask & 1 << encoder)
                encoders_set(encoder, asked->counts.counts[encoder]);
        encoders_forget_missed();
        return OK;
    case START:
        if (!asked->period || asked->period > SLOWEST_MS)
            return BAD_VALUE;
        clock_start(asked->period);
        return OK;
    case STOP:
        clock_stop();
        return OK;
    case WATCHDOG:
        return watchdog(asked->watchdog.operation, asked->watchdog.timeout);
    case LINES:
        inputs_set_lines(asked->lines.mask, asked->lines.levels);
        return OK;
    case SUPPLY:
        if (asked->supply < LOWEST_SUPPLY_MV || asked->supply > HIGHEST_SUPPLY_MV)
            return BAD_VALUE;
        motor_set_supply(asked->supply);
        return OK;
    }
    return UNKNOWN;
}

static void reply(uint8_t type, uint8_t sequence, uint8_t status)
{
    answer said = {.head = HEAD(REPLY), .reply = {.sequence = sequence, .to = type, .status = status}};
    uint8_t length = REPLY_LENGTH;
    said.reply.flags = all_flags();
    said.reply.accepted = accepted;
    if (type == HELLO && status == OK) {
        said.reply.hello.release = FIRMWARE_RELEASE;
        said.reply.hello.steps = MOTOR_STEPS;
        said.reply.hello.silence = SILENCE_MS;
        said.reply.hello.cause = reset_cause;
        length += sizeof said.reply.hello;
    } else if (type == READ && status == OK) {
        int32_t counts[ENCODERS];
        uint16_t turned[ENCODERS];
        ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
        {
            encoders_latch(turned);
        }
        encoders_counts(turned, counts);
        memcpy(said.reply.read.counts, counts, sizeof counts);
        said.reply.read.lines = inputs_lines();
        for (uint8_t input = 0; input < ANALOG_INPUTS; input++)
            said.reply.read.analog[input] = inputs_analog(input);
        said.reply.read.damaged = receiver.damaged;
        said.reply.read.lost = lost;
        said.reply.read.missed = encoders_missed();
        length += sizeof said.reply.read;
    }
    transmit(&said, length);
}

static void hello(uint8_t sequence)
{
    rest();
    in_session = true;
    receiver.damaged = lost = 0;
    encoders_forget_missed();
    expected = sequence + 1;
    accepted = sequence;
    reply(HELLO, sequence, OK);
}

static void handle(uint8_t length)
{
    const request *asked = (const request *)receiver.bytes;
    uint8_t type = asked->head & 0xf;
    if (asked->head >> 4 != PROTOCOL_VERSION) {
        if (length >= 2)
            reply(type, asked->sequence, OTHER_VERSION);
        return;
    }
    if (length < 2 || (LENGTHS[type] && length != LENGTHS[type])) {
        if (length >= 2)
            reply(type, asked->sequence, BAD_VALUE);
        return;
    }
    if (type == HELLO) {
        hello(asked->sequence);
        return;
    }
    if (in_session) {
        clock_heard();
        lost += (uint8_t)(asked->sequence - expected);
        expected = asked->sequence + 1;
    }
    if (type == OUTPUT || type == RELOAD || type == ALIVE) { /* posted */
        if (in_session && type == OUTPUT)
            set_output(asked->millivolts, asked->sequence);
        else if (in_session && type == RELOAD)
            clock_reload();
        return;
    }
    uint8_t sequence = asked->sequence, status = in_session ? obey(type, asked) : NO_SESSION;
    reply(type, sequence, status);
}

static void send_sample(const clock_sample *taken)
{
    answer said = {.head = HEAD(SAMPLE), .sample = {.number = taken->number}};
    int32_t counts[ENCODERS];
    encoders_counts(taken->turned, counts);
    memcpy(said.sample.counts, counts, sizeof counts);
    said.sample.flags = all_flags();
    said.sample.accepted = accepted;
    said.sample.lines = inputs_lines();
    for (uint8_t input = 0; input < ANALOG_INPUTS; input++)
        said.sample.analog[input] = inputs_analog(input);
    transmit(&said, sizeof said.head + sizeof said.sample);
}

void session_begin(uint8_t cause)
{
    reset_cause = cause;
    answer said = {.head = HEAD(BOOTED), .cause = cause};
    transmit(&said, sizeof said.head + sizeof said.cause);
}

void session_attend(void)
{
    uint8_t byte;
    clock_sample taken;
    while (!clock_has_sample() && uart_take(&byte)) {
        uint8_t length = frame_take(&receiver, byte);
        if (length)
            handle(length);
    }
    if (clock_take(&taken))
        send_sample(&taken);
}
