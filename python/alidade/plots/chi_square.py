# SPDX-License-Identifier: Apache-2.0
"""Quantiles of the chi-square distribution."""
from __future__ import annotations

import math


def probability(x: float, dof: float) -> float:
    """Returns the probability that a chi-square variable with `dof` degrees of freedom is at most
    x: the series of the regularised incomplete gamma function P(dof / 2, x / 2)."""
    a, y = dof / 2, x / 2
    if y <= 0:
        return 0.0
    term = math.exp(a * math.log(y) - y - math.lgamma(a + 1))
    total, n = term, 0
    while term > 1e-17 * total and n < 100_000:
        n += 1
        term *= y / (a + n)
        total += term
    return min(total, 1.0)


def quantile(share: float, dof: float) -> float:
    """Returns the x that a chi-square variable exceeds with probability 1 - share."""
    low, high = 0.0, 10 * dof + 100
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if probability(middle, dof) < share else (low, middle)
    return (low + high) / 2
