/* A player of leg setpoints that obeys a feed override and keeps the limits of the legs: no HAL, no libraries.
 *
 * SPDX-License-Identifier: MIT
 *
 * The program is a cubic B-spline q(x), x in rows. The player chooses the pace r = dx/dt, in rows a tick, so the path is
 * kept whatever the pace. At a constant pace of at most 1 the legs keep every limit that the program keeps. A change of
 * the pace is a polynomial of the fifth degree in time, without a step in r, r' and r''. Before it begins it is played
 * to its end on the rows that are already here, and the differences of the legs are compared with the limits of velocity,
 * acceleration and jerk; a change that breaks one is not made, and in the next tick another one is tried: longer,
 * smaller, later. Above 1 the player only stays while a change back to 1, from the next tick on, has passed as well.
 *
 * player_numbers.h has the machine's: PENTAPOD_LEGS; PENTAPOD_RATE, _ACCELERATION and _JERK of each leg, in mm a tick,
 * a tick squared and cubed.
 */
#ifndef PENTAPOD_PLAYER_H
#define PENTAPOD_PLAYER_H

#include "player_numbers.h"

#define PENTAPOD_RING 2048      /* coefficients of each leg that are kept, a power of two */
#define PENTAPOD_RESERVE 700    /* rows ahead below which the player stops, since more do not come */
#define PENTAPOD_LONGEST 400    /* ticks of a change */
#define PENTAPOD_FASTEST 1.2    /* largest pace */
#define PENTAPOD_COOLING 250    /* ticks before a pace above 1 is tried again */
#define PENTAPOD_SLACK 1e-7     /* relative: programs meet limits to the last digit */

static const int pentapod_ticks[] = {40, 60, 90, 140, 220, PENTAPOD_LONGEST};
static const double pentapod_parts[] = {1.0, 0.5, 0.2, 0.05};
#define PENTAPOD_DURATIONS 6
#define PENTAPOD_TRIALS (PENTAPOD_DURATIONS * 4)

/* x(m) from `at` on: pace p[0] + p[1] u + …, u = m / ticks in [0, 1]; afterwards `end`. */
typedef struct {
    double at, p[6], end;
    long ticks;
} pentapod_change;

typedef struct {
    double ring[PENTAPOD_RING][PENTAPOD_LEGS];
    long have, rows;                 /* coefficients that came; rows of the program, which has rows + 2 of them */
    double place, pace;              /* in rows, rows a tick */
    double last[3][PENTAPOD_LEGS];   /* legs of the last ticks, the newest first */
    pentapod_change change;          /* the one that is played; ticks 0 for none */
    long tick;                       /* ticks of it that are played */
    long escape, cooling;            /* ticks of the way back to pace 1 that has passed; ticks to wait */
    int trial, started, done, starved, underrun;
} pentapod_player;

static void pentapod_begin(pentapod_player *player, long rows)
{
    int k;
    player->have = 0;
    player->rows = rows;
    player->place = player->pace = 0.0;
    player->change.ticks = player->tick = player->escape = player->cooling = 0;
    for (k = 0; k < 6; k++)
        player->change.p[k] = 0.0;
    player->change.at = player->change.end = 0.0;
    player->trial = player->started = player->done = player->starved = player->underrun = 0;
}

/* Whether two more coefficients fit; the four around the place stay. */
static int pentapod_has_room(const pentapod_player *player)
{
    return player->have < player->rows + 2 && player->have + 2 - (long)player->place <= PENTAPOD_RING - 8;
}

/* Takes two coefficients, with which `number` have come; those that are here already, or come too early, are left. */
static void pentapod_take(pentapod_player *player, long number, const double *pair)
{
    int k, j;
    if (number != player->have + 2 || !pentapod_has_room(player))
        return;
    for (j = 0; j < 2; j++, player->have++)
        for (k = 0; k < PENTAPOD_LEGS; k++)
            player->ring[player->have & (PENTAPOD_RING - 1)][k] = pair[j * PENTAPOD_LEGS + k];
}

static int pentapod_is_ready(const pentapod_player *player)
{
    return player->rows > 1 && player->have >= 4 && !pentapod_has_room(player);
}

/* Legs at a place; 0 where the coefficients are not here. */
static int pentapod_legs_at(const pentapod_player *player, double place, double *legs)
{
    const double *c[4];
    double t, s, b[4];
    long i;
    int k, j;
    if (place < 0.0)
        place = 0.0;
    if (place > (double)(player->rows - 1))
        place = (double)(player->rows - 1);
    i = (long)place;
    if (i > player->rows - 2)
        i = player->rows - 2;
    if (i + 3 >= player->have)
        return 0;
    t = place - (double)i;
    s = 1.0 - t;
    b[0] = s * s * s / 6.0;
    b[1] = (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0;
    b[2] = (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0;
    b[3] = t * t * t / 6.0;
    for (j = 0; j < 4; j++)
        c[j] = player->ring[(i + j) & (PENTAPOD_RING - 1)];
    /* About the second one, so that little is lost to rounding. */
    for (k = 0; k < PENTAPOD_LEGS; k++)
        legs[k] = c[1][k] + b[0] * (c[0][k] - c[1][k]) + b[2] * (c[2][k] - c[1][k]) + b[3] * (c[3][k] - c[1][k]);
    return 1;
}

/* From pace, its change a tick and that of the change, to a constant pace `end`. */
static void pentapod_plan(
    pentapod_change *change, double at, double pace, double slope, double bend, double end, long ticks)
{
    double n = (double)ticks, v = slope * n, a = bend * n * n, step = end - pace;
    change->at = at;
    change->end = end;
    change->ticks = ticks;
    change->p[0] = pace;
    change->p[1] = v;
    change->p[2] = 0.5 * a;
    change->p[3] = 10.0 * step - 6.0 * v - 1.5 * a;
    change->p[4] = -15.0 * step + 8.0 * v + 1.5 * a;
    change->p[5] = 6.0 * step - 3.0 * v - 0.5 * a;
}

static double pentapod_place_of(const pentapod_change *change, long tick)
{
    double n = (double)change->ticks, u, x = 0.0;
    long m = tick < change->ticks ? tick : change->ticks;
    int k;
    if (change->ticks > 0) {
        u = (double)m / n;
        for (k = 5; k >= 0; k--)
            x = (x + change->p[k] / (double)(k + 1)) * u;
    }
    return change->at + n * x + (double)(tick - m) * change->end;
}

static double pentapod_pace_of(const pentapod_change *change, long tick, double *slope, double *bend)
{
    double n = (double)change->ticks, u, r = 0.0, d = 0.0, e = 0.0;
    int k;
    *slope = *bend = 0.0;
    if (tick >= change->ticks)
        return change->end;
    u = (double)tick / n;
    for (k = 5; k >= 0; k--) {
        e = e * u + d;
        d = d * u + r;
        r = r * u + change->p[k];
    }
    *slope = d / n;
    *bend = 2.0 * e / (n * n);
    return r;
}

static int pentapod_keeps(double value, double limit)
{
    return value <= limit && value >= -limit;
}

/* Whether the legs keep their limits over so many ticks of a change, played after the last ticks; `then` follows after
 * `first` ticks, if it is given. */
static int pentapod_passes(
    const pentapod_player *player, const pentapod_change *change, long first, const pentapod_change *then, long ticks)
{
    static const double rate[] = PENTAPOD_RATE, acceleration[] = PENTAPOD_ACCELERATION, jerk[] = PENTAPOD_JERK;
    double before[3][PENTAPOD_LEGS], legs[PENTAPOD_LEGS], place, reached = -1.0;
    long m;
    int k, j;
    for (j = 0; j < 3; j++)
        for (k = 0; k < PENTAPOD_LEGS; k++)
            before[j][k] = player->last[j][k];
    for (m = 1; m <= ticks; m++) {
        place = then && m > first ? pentapod_place_of(then, m - first) : pentapod_place_of(change, m);
        if (place < reached || !pentapod_legs_at(player, place, legs))
            return 0;
        reached = place;
        for (k = 0; k < PENTAPOD_LEGS; k++) {
            double d1 = legs[k] - before[0][k], e1 = before[0][k] - before[1][k], f1 = before[1][k] - before[2][k];
            double d2 = d1 - e1, d3 = d2 - (e1 - f1);
            if (!pentapod_keeps(d1, (1.0 + PENTAPOD_SLACK) * rate[k])
                || !pentapod_keeps(d2, (1.0 + PENTAPOD_SLACK) * acceleration[k])
                || !pentapod_keeps(d3, (1.0 + PENTAPOD_SLACK) * jerk[k]))
                return 0;
            before[2][k] = before[1][k];
            before[1][k] = before[0][k];
            before[0][k] = legs[k];
        }
    }
    return 1;
}

/* Tries one change towards the pace that is wanted, another one in each tick. */
static void pentapod_try(pentapod_player *player, double wanted)
{
    pentapod_change change, back;
    double slope, bend, pace, end, step;
    long ticks = pentapod_ticks[player->trial % PENTAPOD_DURATIONS], escape = 0;
    pace = pentapod_pace_of(&player->change, player->tick, &slope, &bend);
    step = pentapod_parts[player->trial / PENTAPOD_DURATIONS] * (wanted - pace);
    player->trial = (player->trial + 1) % PENTAPOD_TRIALS;
    end = pace + step;
    if (end < 1e-3 && wanted < 1e-3)
        end = 0.0;
    pentapod_plan(&change, player->place, pace, slope, bend, end, ticks);
    if (end > 1.0) {
        escape = pentapod_ticks[player->trial % 4];
        pentapod_plan(&back, pentapod_place_of(&change, ticks), end, 0.0, 0.0, 1.0, escape);
    }
    if (!pentapod_passes(player, &change, ticks, escape ? &back : 0, ticks + escape + 3))
        return;
    player->change = change;
    player->tick = 0;
    player->escape = escape;
    player->trial = 0;
}

/* At a constant pace above 1: may it last one tick more? Else the way back, which has passed, is gone. */
static void pentapod_stay(pentapod_player *player)
{
    pentapod_change stay, back;
    long n[2];
    int k;
    n[0] = player->escape;
    n[1] = pentapod_ticks[player->trial % 4];
    player->trial = (player->trial + 1) % PENTAPOD_TRIALS;
    pentapod_plan(&stay, player->place, player->pace, 0.0, 0.0, player->pace, 1);
    for (k = 0; k < 2; k++) {
        pentapod_plan(&back, pentapod_place_of(&stay, 1), player->pace, 0.0, 0.0, 1.0, n[k]);
        if (pentapod_passes(player, &stay, 1, &back, n[k] + 4)) {
            player->escape = n[k];
            return;
        }
    }
    pentapod_plan(&player->change, player->place, player->pace, 0.0, 0.0, 1.0, player->escape);
    player->tick = 0;
    player->cooling = PENTAPOD_COOLING;
}

/* One tick: the legs, at the pace that is wanted as soon as the limits allow. Before it is ready, the first row. */
static void pentapod_play(pentapod_player *player, double wanted, double *legs)
{
    double slope, bend, next;
    int k;
    if (!player->started) {
        player->started = pentapod_is_ready(player);
        if (!pentapod_legs_at(player, 0.0, legs))
            return;
        for (k = 0; k < PENTAPOD_LEGS; k++)
            player->last[0][k] = player->last[1][k] = player->last[2][k] = legs[k];
        return;
    }
    wanted = wanted > 0.0 ? wanted : 0.0; /* also for what is no number */
    wanted = wanted < PENTAPOD_FASTEST ? wanted : PENTAPOD_FASTEST;
    player->starved = player->have < player->rows + 2 && (double)player->have - player->place < PENTAPOD_RESERVE;
    if (player->starved)
        wanted = 0.0;
    if (player->cooling > 0) {
        player->cooling--;
        wanted = wanted < 1.0 ? wanted : 1.0;
    }
    if (player->tick >= player->change.ticks && player->pace > 1.0)
        pentapod_stay(player);
    if (wanted != player->change.end)
        pentapod_try(player, wanted);
    player->tick++;
    next = pentapod_place_of(&player->change, player->tick);
    if (!pentapod_legs_at(player, next, legs)) {
        player->underrun = 1; /* the rows did not come: stands at the last ones, without regard to limits */
        for (k = 0; k < PENTAPOD_LEGS; k++)
            legs[k] = player->last[0][k];
        player->tick--;
        return;
    }
    player->place = next;
    player->pace = pentapod_pace_of(&player->change, player->tick, &slope, &bend);
    if (player->tick >= player->change.ticks) { /* so that ticks of a constant pace do not add up */
        pentapod_plan(&player->change, player->place, player->pace, 0.0, 0.0, player->pace, 0);
        player->tick = 0;
    }
    player->done = player->place >= (double)(player->rows - 1);
    for (k = 0; k < PENTAPOD_LEGS; k++) {
        player->last[2][k] = player->last[1][k];
        player->last[1][k] = player->last[0][k];
        player->last[0][k] = legs[k];
    }
}

#endif
