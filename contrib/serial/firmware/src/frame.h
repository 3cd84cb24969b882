/* Frames: a body and its checksum, with no zero inside (COBS), and a zero at the end. Plain C, for any machine. */
#ifndef FRAME_H
#define FRAME_H

#include <stdint.h>

#define FRAME_BODY 28                   /* bytes of the longest body */
#define FRAME_PACKED (FRAME_BODY + 4)   /* with the checksum's two, COBS's one, and the zero */

typedef struct {
    uint8_t bytes[FRAME_PACKED];
    uint8_t length;   /* of what came since the last zero */
    uint16_t damaged; /* frames thrown away, up to the most that fits */
} frame_receiver;

uint16_t frame_crc(const uint8_t *bytes, uint8_t length);

/* Writes a body as a frame into packed (FRAME_PACKED bytes), and returns its length. */
uint8_t frame_pack(const uint8_t *body, uint8_t length, uint8_t *packed);

/* Takes one byte off the line. Returns the length of a whole frame's body, which is then in receiver->bytes; else 0. */
uint8_t frame_take(frame_receiver *receiver, uint8_t byte);

#endif
