/* LinuxCNC's side of pentapod_contour.h: pins, and the function in the servo thread.
 *
 * SPDX-License-Identifier: MIT
 * LinuxCNC's headers are GPL-2, so what is compiled of this file is under GPL-2, too.
 */
#include "rtapi.h"
#include "rtapi_app.h"
#include "hal.h"
#include "pentapod_pins.h"
#include "pentapod_contour.h"

MODULE_LICENSE("GPL");
MODULE_DESCRIPTION("corrects the legs of a linear pentapod by the tool's way across the path");

static struct pins {
    pentapod_real command[PENTAPOD_LEGS], feedback[PENTAPOD_LEGS], motor[PENTAPOD_LEGS], out[PENTAPOD_LEGS];
    pentapod_real tool_length, gain, memory, bound, range, share, error, size;
    pentapod_bit enable, active, bounded;
} *pins;

static pentapod_contour contour;
static int owner;

/* In the servo thread, after what makes the commands. */
static void correct(void *argument, long period)
{
    pentapod_contour_settings settings;
    pentapod_contour_report report;
    double command[PENTAPOD_LEGS], feedback[PENTAPOD_LEGS];
    int k;
    (void)argument;
    settings.tool_length = GET_REAL(pins->tool_length);
    settings.gain = GET_REAL(pins->gain);
    settings.memory = GET_REAL(pins->memory);
    settings.bound = 1e-3 * GET_REAL(pins->bound);
    settings.range = 1e-3 * GET_REAL(pins->range);
    settings.share = GET_REAL(pins->share);
    /* The model of the drives is that of one period. */
    settings.enable = GET_BIT(pins->enable) && fabs(1e-9 * (double)period - PENTAPOD_PERIOD) < 0.02 * PENTAPOD_PERIOD;
    for (k = 0; k < PENTAPOD_LEGS; k++) {
        command[k] = GET_REAL(pins->command[k]);
        feedback[k] = GET_REAL(pins->feedback[k]);
    }
    pentapod_contour_correction(command, feedback, &settings, &contour, &report);
    for (k = 0; k < PENTAPOD_LEGS; k++)
        SET_REAL(pins->out[k], GET_REAL(pins->motor[k]) + contour.shift[k]);
    SET_REAL(pins->error, report.error);
    SET_REAL(pins->size, 1e3 * report.size);
    SET_BIT(pins->active, report.active);
    SET_BIT(pins->bounded, report.bounded);
}

static int make_pins(void)
{
    int k, bad = 0;
    for (k = 0; k < PENTAPOD_LEGS; k++) {
        bad |= NEW_REAL(owner, HAL_IN, pins->command[k], 0.0, "pentapod-contour.command.%d", k);
        bad |= NEW_REAL(owner, HAL_IN, pins->feedback[k], 0.0, "pentapod-contour.feedback.%d", k);
        bad |= NEW_REAL(owner, HAL_IN, pins->motor[k], 0.0, "pentapod-contour.motor.%d", k);
        bad |= NEW_REAL(owner, HAL_OUT, pins->out[k], 0.0, "pentapod-contour.out.%d", k);
    }
    bad |= NEW_BIT(owner, HAL_IN, pins->enable, 0, "pentapod-contour.enable");
    bad |= NEW_REAL(owner, HAL_IN, pins->bound, @BOUND_UM@, "pentapod-contour.bound-um");
    bad |= NEW_REAL(owner, HAL_IN, pins->range, @RANGE_UM@, "pentapod-contour.range-um");
    bad |= NEW_REAL(owner, HAL_IN, pins->gain, 1.0, "pentapod-contour.gain");
    bad |= NEW_REAL(owner, HAL_IN, pins->memory, PENTAPOD_MEMORY, "pentapod-contour.memory");
    bad |= NEW_REAL(owner, HAL_IN, pins->share, @SHARE@, "pentapod-contour.acceleration-share");
    bad |= NEW_REAL(owner, HAL_IN, pins->tool_length, PENTAPOD_TOOL_LENGTH, "pentapod-contour.tool-length");
    bad |= NEW_REAL(owner, HAL_OUT, pins->error, 0.0, "pentapod-contour.error");
    bad |= NEW_REAL(owner, HAL_OUT, pins->size, 0.0, "pentapod-contour.size-um");
    bad |= NEW_BIT(owner, HAL_OUT, pins->active, 0, "pentapod-contour.active");
    bad |= NEW_BIT(owner, HAL_OUT, pins->bounded, 0, "pentapod-contour.bounded");
    return bad;
}

int rtapi_app_main(void)
{
    owner = hal_init("pentapod_contour");
    if (owner < 0)
        return owner;
    pins = hal_malloc(sizeof(*pins));
    if (!pins || make_pins() || hal_export_funct("pentapod-contour", correct, 0, 1, 0, owner) < 0) {
        hal_exit(owner);
        return -1;
    }
    hal_ready(owner);
    return 0;
}

void rtapi_app_exit(void)
{
    hal_exit(owner);
}
