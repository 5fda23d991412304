/* Pins as LinuxCNC's development branch of 2026 has them: references with getters and setters.
 * SPDX-License-Identifier: MIT */
#ifndef PENTAPOD_PINS_H
#define PENTAPOD_PINS_H

typedef hal_real_t pentapod_real;
typedef hal_bool_t pentapod_bit;
typedef hal_uint_t pentapod_count;
typedef hal_sint_t pentapod_number;

#define GET_REAL(pin) ((double)hal_get_real(pin))
#define GET_BIT(pin) ((int)hal_get_bool(pin))
#define GET_COUNT(pin) ((unsigned)hal_get_ui32(pin))
#define GET_NUMBER(pin) ((int)hal_get_si32(pin))
#define SET_REAL(pin, value) ((void)hal_set_real(pin, value))
#define SET_BIT(pin, value) ((void)hal_set_bool(pin, (value) != 0))
#define SET_COUNT(pin, value) ((void)hal_set_ui32(pin, value))

/* 0 where the pin was made, and holds this value; negative else. */
#define NEW_REAL(owner, way, pin, value, ...) hal_pin_new_real(owner, way, &(pin), value, __VA_ARGS__)
#define NEW_BIT(owner, way, pin, value, ...) hal_pin_new_bool(owner, way, &(pin), value, __VA_ARGS__)
#define NEW_COUNT(owner, way, pin, value, ...) hal_pin_new_ui32(owner, way, &(pin), value, __VA_ARGS__)
#define NEW_NUMBER(owner, way, pin, value, ...) hal_pin_new_si32(owner, way, &(pin), value, __VA_ARGS__)

#endif
