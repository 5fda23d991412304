/* LinuxCNC's side of pentapod_player.h: pins, and the function in the servo thread.
 *
 * SPDX-License-Identifier: MIT
 * LinuxCNC's headers are GPL-2, so what is compiled of this file is under GPL-2, too.
 */
#include "rtapi.h"
#include "rtapi_app.h"
#include "hal.h"
#include "pentapod_pins.h"
#include "pentapod_player.h"

MODULE_LICENSE("GPL");
MODULE_DESCRIPTION("plays leg setpoints with feed override and hold within the limits of the legs");

static struct pins {
    pentapod_real number, coefficient[2 * PENTAPOD_LEGS], override, leg[PENTAPOD_LEGS], pace, row;
    pentapod_bit run, hold, abort, more, ready, done, stopped, starved, underrun;
} *pins;

static pentapod_player player;
static int owner, aborted;

static void play(void *argument, long period)
{
    double pair[2 * PENTAPOD_LEGS], legs[PENTAPOD_LEGS], wanted;
    int k;
    (void)argument;
    (void)period;
    for (k = 0; k < 2 * PENTAPOD_LEGS; k++)
        pair[k] = GET_REAL(pins->coefficient[k]);
    pentapod_take(&player, (long)GET_REAL(pins->number), pair);
    aborted |= GET_BIT(pins->abort);
    wanted = GET_BIT(pins->run) && !GET_BIT(pins->hold) && !aborted ? GET_REAL(pins->override) : 0.0;
    if (player.have >= 4) {
        pentapod_play(&player, wanted, legs);
        for (k = 0; k < PENTAPOD_LEGS; k++)
            SET_REAL(pins->leg[k], legs[k]);
    }
    SET_BIT(pins->more, !aborted && pentapod_has_room(&player));
    SET_BIT(pins->ready, player.started);
    SET_BIT(pins->done, player.done);
    SET_BIT(pins->stopped, aborted && player.pace == 0.0);
    SET_BIT(pins->starved, player.starved);
    SET_BIT(pins->underrun, player.underrun);
    SET_REAL(pins->pace, player.pace);
    SET_REAL(pins->row, player.place);
}

static int make_pins(void)
{
    int k, bad = 0;
    bad |= NEW_REAL(owner, HAL_IN, pins->number, 0.0, "pentapod-player.number");
    bad |= NEW_REAL(owner, HAL_IN, pins->override, 1.0, "pentapod-player.override");
    bad |= NEW_REAL(owner, HAL_OUT, pins->pace, 0.0, "pentapod-player.pace");
    bad |= NEW_REAL(owner, HAL_OUT, pins->row, 0.0, "pentapod-player.row");
    for (k = 0; k < 2 * PENTAPOD_LEGS; k++)
        bad |= NEW_REAL(owner, HAL_IN, pins->coefficient[k], 0.0, "pentapod-player.coefficient.%d", k);
    for (k = 0; k < PENTAPOD_LEGS; k++)
        bad |= NEW_REAL(owner, HAL_OUT, pins->leg[k], 0.0, "pentapod-player.leg.%d", k);
    bad |= NEW_BIT(owner, HAL_IN, pins->run, 0, "pentapod-player.run");
    bad |= NEW_BIT(owner, HAL_IN, pins->hold, 0, "pentapod-player.hold");
    bad |= NEW_BIT(owner, HAL_IN, pins->abort, 0, "pentapod-player.abort");
    bad |= NEW_BIT(owner, HAL_OUT, pins->more, 0, "pentapod-player.more");
    bad |= NEW_BIT(owner, HAL_OUT, pins->ready, 0, "pentapod-player.ready");
    bad |= NEW_BIT(owner, HAL_OUT, pins->done, 0, "pentapod-player.done");
    bad |= NEW_BIT(owner, HAL_OUT, pins->stopped, 0, "pentapod-player.stopped");
    bad |= NEW_BIT(owner, HAL_OUT, pins->starved, 0, "pentapod-player.starved");
    bad |= NEW_BIT(owner, HAL_OUT, pins->underrun, 0, "pentapod-player.underrun");
    return bad;
}

int rtapi_app_main(void)
{
    owner = hal_init("pentapod_player");
    if (owner < 0)
        return owner;
    pins = hal_malloc(sizeof(*pins));
    pentapod_begin(&player, PENTAPOD_ROWS);
    if (!pins || make_pins() || hal_export_funct("pentapod-player", play, 0, 1, 0, owner) < 0) {
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
