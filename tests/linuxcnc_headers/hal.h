/* Stand-in for the headers of LinuxCNC's development branch: declarations of what the module calls, of the tests' own. */
#ifndef STAND_IN_HAL_H
#define STAND_IN_HAL_H
#include <stdbool.h>
#include <stdint.h>

typedef struct { volatile double *at; } hal_real_t;
typedef struct { volatile bool *at; } hal_bool_t;
typedef struct { volatile uint64_t *at; } hal_uint_t;
typedef struct { volatile int64_t *at; } hal_sint_t;
typedef enum { HAL_IN = 16, HAL_OUT = 32, HAL_IO = 48 } hal_pdir_t;

double hal_get_real(hal_real_t pin);
double hal_set_real(hal_real_t pin, double value);
bool hal_get_bool(hal_bool_t pin);
bool hal_set_bool(hal_bool_t pin, bool value);
uint32_t hal_get_ui32(hal_uint_t pin);
uint32_t hal_set_ui32(hal_uint_t pin, uint32_t value);
int32_t hal_get_si32(hal_sint_t pin);

int hal_pin_new_real(int owner, hal_pdir_t way, hal_real_t *pin, double value, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
int hal_pin_new_bool(int owner, hal_pdir_t way, hal_bool_t *pin, bool value, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
int hal_pin_new_ui32(int owner, hal_pdir_t way, hal_uint_t *pin, uint32_t value, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
int hal_pin_new_si32(int owner, hal_pdir_t way, hal_sint_t *pin, int32_t value, const char *format, ...)
    __attribute__((format(printf, 5, 6)));

int hal_init(const char *name);
int hal_ready(int owner);
int hal_exit(int owner);
void *hal_malloc(long size);
int hal_export_funct(
    const char *name, void (*function)(void *, long), void *argument, int floating, int reentrant, int owner);
#endif
