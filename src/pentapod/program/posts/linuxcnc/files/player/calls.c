/* What pentapod calls of pentapod_player.h. SPDX-License-Identifier: MIT */
#include "pentapod_player.h"

static pentapod_player player;

static long feed(long next, long count, const double *pairs)
{
    if (next < count) {
        pentapod_take(&player, 2 * next + 2, pairs + 2 * PENTAPOD_LEGS * next);
        next += player.have > 2 * next;
    }
    return next;
}

/* wanted: the override in each tick; rows come until tick `fed`. Returns the ticks that were played. */
long play(long count, const double *pairs, long most, long fed, const double *wanted, double *legs, double *out)
{
    long n, next = 0;
    pentapod_begin(&player, PENTAPOD_ROWS);
    while (!player.started) {
        next = feed(next, count, pairs);
        pentapod_play(&player, 0.0, legs);
    }
    for (n = 0; n < most && !player.done; n++) {
        if (n < fed)
            next = feed(next, count, pairs);
        pentapod_play(&player, wanted[n], legs + PENTAPOD_LEGS * n);
        out[3 * n] = player.place;
        out[3 * n + 1] = player.pace;
        out[3 * n + 2] = (double)(player.starved + 2 * player.underrun);
    }
    return n;
}
