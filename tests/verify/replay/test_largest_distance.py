"""The largest distance of a matching, by loops over samples and waypoints."""

import numpy as np
import pytest

from pentapod.verify.replay.free_space import FreeSpace, FreeSpaceOptions, Pairing, PosedPolyline


@pytest.mark.parametrize("at_once", [1, 3, 7, 1000])
def test_the_largest_distance_counts_both_chords_at_a_sample_and_always_the_ends(at_once):
    """Where axes have a weight only the ends count; in blocks of samples as for all of them."""
    rng = np.random.default_rng(8)
    count, waypoints, options = 40, 9, FreeSpaceOptions(at_once=at_once)
    motion, path = (PosedPolyline(rng.random((n, 3)), np.tile([0.0, 0.0, 1.0], (n, 1))) for n in (count, waypoints))
    for _ in range(50):
        deviations = rng.random(count - 1)
        weighs, near = rng.random(waypoints - 1) < 0.8, rng.random(waypoints) < 0.8
        space = FreeSpace(motion, path, (1.0 * weighs, 1.0 * near, 1.0), deviations, np.pi, options)
        intervals = np.sort(rng.integers(0, waypoints - 1, count))
        times = np.sort(rng.uniform(0.0, count - 1.0, waypoints))
        at_samples, at_waypoints = rng.random(count), rng.random(waypoints)
        wanted = [
            at_samples[k] + max(deviations[max(k - 1, 0) : k + 1])
            for k in range(count)
            if k in (0, count - 1) or not weighs[intervals[k]]
        ]
        wanted += [
            at_waypoints[k] + deviations[int(times[k])]
            for k in range(waypoints)
            if k in (0, waypoints - 1) or not near[k]
        ]
        pairing = Pairing(intervals, 0.0 * times, 0.0 * times, times, 0.0)
        assert space.largest(pairing, at_samples, at_waypoints) == max(wanted)
