/* Pins as LinuxCNC 2.9 has them: pointers. SPDX-License-Identifier: MIT */
#ifndef PENTAPOD_PINS_H
#define PENTAPOD_PINS_H

typedef hal_float_t *pentapod_real;
typedef hal_bit_t *pentapod_bit;
typedef hal_u32_t *pentapod_count;
typedef hal_s32_t *pentapod_number;

#define GET_REAL(pin) ((double)*(pin))
#define GET_BIT(pin) ((int)*(pin))
#define GET_COUNT(pin) ((unsigned)*(pin))
#define GET_NUMBER(pin) ((int)*(pin))
#define SET_REAL(pin, value) (*(pin) = (value))
#define SET_BIT(pin, value) (*(pin) = (value) != 0)
#define SET_COUNT(pin, value) (*(pin) = (value))

/* 0 where the pin was made, and holds this value; negative else. */
#define NEW_REAL(owner, way, pin, value, ...) \
    (hal_pin_float_newf(way, &(pin), owner, __VA_ARGS__) < 0 ? -1 : (*(pin) = (value), 0))
#define NEW_BIT(owner, way, pin, value, ...) \
    (hal_pin_bit_newf(way, &(pin), owner, __VA_ARGS__) < 0 ? -1 : (*(pin) = (value), 0))
#define NEW_COUNT(owner, way, pin, value, ...) \
    (hal_pin_u32_newf(way, &(pin), owner, __VA_ARGS__) < 0 ? -1 : (*(pin) = (value), 0))
#define NEW_NUMBER(owner, way, pin, value, ...) \
    (hal_pin_s32_newf(way, &(pin), owner, __VA_ARGS__) < 0 ? -1 : (*(pin) = (value), 0))

#endif
