#include "frame.h"

#define LONGEST_PIECE (FRAME_PACKED - 1) /* what can stand before the zero */

/* CRC-16/CCITT-FALSE (polynomial 0x1021 from 0xffff), a byte at a time without a table. */
uint16_t frame_crc(const uint8_t *bytes, uint8_t length)
{
    uint16_t crc = 0xffff;
    while (length--) {
        crc = (uint16_t)((crc >> 8) | (crc << 8));
        crc ^= *bytes++;
        crc ^= (crc & 0xff) >> 4;
        crc ^= (uint16_t)(crc << 12);
        crc ^= (uint16_t)((crc & 0xff) << 5);
    }
    return crc;
}

uint8_t frame_pack(const uint8_t *body, uint8_t length, uint8_t *packed)
{
    uint16_t crc = frame_crc(body, length);
    uint8_t code = 0, end = 1; /* where the distance to the next zero goes */
    for (uint8_t at = 0; at < length + 2; at++) {
        uint8_t byte = at < length ? body[at] : at == length ? (uint8_t)crc : (uint8_t)(crc >> 8);
        if (byte) {
            packed[end++] = byte;
        } else {
            packed[code] = (uint8_t)(end - code);
            code = end++;
        }
    }
    packed[code] = (uint8_t)(end - code);
    packed[end++] = 0;
    return end;
}

/* Undoes COBS where it stands. Returns the length, or 0 if it is none. */
static uint8_t unstuff(uint8_t *bytes, uint8_t length)
{
    uint8_t to = 0, from = 0;
    while (from < length) {
        uint8_t code = bytes[from++];
        if (code - 1 > length - from)
            return 0;
        while (--code)
            bytes[to++] = bytes[from++];
        if (from < length)
            bytes[to++] = 0;
    }
    return to;
}

static uint8_t whole(frame_receiver *receiver)
{
    uint8_t length = receiver->length;
    if (length > LONGEST_PIECE)
        return 0;
    length = unstuff(receiver->bytes, length);
    if (length < 3)
        return 0;
    length -= 2;
    uint16_t crc = (uint16_t)(receiver->bytes[length] | receiver->bytes[length + 1] << 8);
    return frame_crc(receiver->bytes, length) == crc ? length : 0;
}

uint8_t frame_take(frame_receiver *receiver, uint8_t byte)
{
    if (byte) {
        if (receiver->length < LONGEST_PIECE)
            receiver->bytes[receiver->length++] = byte;
        else
            receiver->length = LONGEST_PIECE + 1; /* too long for any frame */
        return 0;
    }
    if (!receiver->length)
        return 0; /* zeros between frames mean nothing */
    uint8_t length = whole(receiver);
    receiver->length = 0;
    if (!length && receiver->damaged < 0xffff)
        receiver->damaged++;
    return length;
}
