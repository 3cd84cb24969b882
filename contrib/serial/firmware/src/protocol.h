/* The protocol between the program and the board: README.md has it in words, rotflex_serial/protocol.py
 * in Python; a test holds the two against each other. All numbers are little-endian. */
#ifndef PROTOCOL_H
#define PROTOCOL_H

#ifndef PROTOCOL_VERSION
#define PROTOCOL_VERSION 1 /* the upper half of each frame's first byte; the lower half is its type */
#endif

enum type {
    /* from the program */
    HELLO = 1,    /* begins a session: motor at 0 V, nothing sampled, nothing watched */
    BYE = 2,      /* ends it */
    OUTPUT = 3,   /* posted, as RELOAD and ALIVE are: not answered. int16 mV at the motor */
    RELOAD = 4,   /* reloads the program's watchdog */
    READ = 5,     /* asks for all inputs */
    COUNTS = 6,   /* uint8 mask of encoders, int32 counts of each */
    START = 7,    /* uint16 ms between samples */
    STOP = 8,     /* no more samples */
    WATCHDOG = 9, /* uint8 operation, uint16 time-out in ms */
    LINES = 10,   /* uint8 mask of digital outputs, uint8 levels */
    SUPPLY = 11,  /* uint16 mV that the motor's driver is fed with */
    /* from the board */
    SAMPLE = 12,
    REPLY = 13,
    BOOTED = 14,
    /* from the program */
    ALIVE = 15, /* nothing but that the program lives */
};

enum status { OK = 0, UNKNOWN = 1, BAD_VALUE = 2, NO_SESSION = 3, EXPIRED = 4, OTHER_VERSION = 5 };

enum operation { CLEAR = 0, WATCH = 1, UNWATCH = 2 };

enum flag {
    FLAG_EXPIRED = 1,    /* the motor is held at 0 V until the watchdog is cleared */
    FLAG_SILENT = 2,     /* ... because nothing was heard for SILENCE_MS */
    FLAG_WATCHING = 4,   /* the program's watchdog runs */
    FLAG_SAMPLING = 8,   /* samples are being sent */
    FLAG_MISCOUNTED = 16, /* an encoder was too quick: a count may be wrong */
    FLAG_DAMAGED = 32,   /* a frame from the program came damaged, or not at all */
    FLAG_SESSION = 64,   /* HELLO was heard since the start */
};

#define BAUD_RATE 500000
#define SILENCE_MS 50      /* without a frame for so long, a motor that is driven is set to 0 V */
#define SLOWEST_MS 10000   /* the longest time between two samples */
#define LOWEST_SUPPLY_MV 3000
#define HIGHEST_SUPPLY_MV 32000
#define MOTOR_STEPS 800    /* of the pulse width: 20 kHz */
#define ENCODERS 2
#define ANALOG_INPUTS 2
#define DIGITAL_LINES 4

#endif
