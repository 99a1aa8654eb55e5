"""A dead volume of which a record shows only the largest value still goes into fitted.yaml."""

import numpy as np

from pneumo.fit.estimate import limited_ends


def test_only_a_dead_volume_ends_at_the_lowest_value_of_the_search():
    assert limited_ends("V_d_A", (-np.inf, 2.0), -4.0) == (-4.0, 2.0)
    assert limited_ends("V_d_B", (-5.0, 2.0), -4.0) == (-4.0, 2.0)
    assert limited_ends("V_d_A", (-3.0, 2.0), -4.0) == (-3.0, 2.0)
    # Without an upper end the record determines nothing, and a k_0 may be far below any bound.
    assert limited_ends("V_d_A", (-np.inf, np.inf), -4.0) == (-np.inf, np.inf)
    assert limited_ends("k_0", (-np.inf, 2.0), -4.0) == (-np.inf, 2.0)
    assert limited_ends("b", (-np.inf, 0.5), 0.02) == (
        -np.inf,
        0.5,
    )  # nor a critical ratio, though configured
