"""The certificate with compiled kernels and with NumPy: the same answers to the last bit."""

import numpy as np
import pytest
from leg_motions import segments

from pentapod.kinematics import LinearPentapod, certify_component
from pentapod.numerics.kernels import kernels_used


@pytest.mark.parametrize("k", [0, 1, 3, 5])
@pytest.mark.parametrize("leg_error", [0.0, 1e-4])
def test_kernels_equal_numpy_to_the_last_bit(pentapod: LinearPentapod, k: int, leg_error: float) -> None:
    legs = np.concatenate([segments(pentapod, 170, k, 1, 0.01), segments(pentapod, 30, k, 2, 0.3)])
    legs[5, 2, 0], legs[6, 1, -1], legs[7] = np.nan, np.inf, 0.0
    proofs = []
    for policy in ("never", "always"):
        with kernels_used(policy):
            proofs.append(certify_component(pentapod, legs, (1, 1), leg_error=leg_error))
    for name in ("w_lower", "s_lower", "proven", "refuted", "doubt"):
        np.testing.assert_array_equal(*(getattr(proof, name) for proof in proofs))
    assert 0.4 < proofs[0].proven.mean() < 1.0
    assert proofs[0].undecided[5:8].all()
