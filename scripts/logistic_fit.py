"""Logistic models of how probably something is right, for fit_confidence and fit_point_confidence. A table is (terms, right): an
array (n, terms) and n booleans."""

import sys
from pathlib import Path

try:
    import numpy as np
except ModuleNotFoundError:
    sys.exit(f"{Path(sys.argv[0]).name}: needs numpy: apt install python3-numpy, or python3 -m pip install numpy")


def fit(tables):
    """Weights and the constant, last, by Newton's method: each table counts the same, whatever its length."""
    x = np.concatenate([np.c_[t, np.ones(len(t))] for t, _ in tables])
    y = np.concatenate([right for _, right in tables])
    share = np.concatenate([np.full(len(t), 1 / len(t)) for t, _ in tables])
    weights = np.zeros(x.shape[1])
    for _ in range(50):
        p = 1 / (1 + np.exp(-x @ weights))
        gradient = x.T @ (share * (y - p)) - 1e-6 * weights
        curvature = (x * (share * p * (1 - p))[:, None]).T @ x + 1e-6 * np.eye(x.shape[1])
        step = np.linalg.solve(curvature, gradient)
        weights += step
        if np.abs(step).max() < 1e-8:
            break
    return weights


def probability(terms, weights):
    return 1 / (1 + np.exp(-(terms @ weights[:-1] + weights[-1])))


def of_other_scenes(tables, name):
    """By name; a scene's name ends at the first underscore."""
    scene = lambda name: name.removeprefix("tab_").split("_")[0]
    return [table for other, table in tables.items() if scene(other) != scene(name)]


TENTHS = " | ".join(f"{low / 10:.1f}" for low in range(10))


def right_by_tenth(right, p, least):
    """Columns under TENTHS: of those with that probability, how many percent are right; empty where they are `least` or fewer."""
    bins = [right[(p >= low / 10) & (p < (low + 1) / 10)] for low in range(10)]
    return " | ".join(f"{100 * b.mean():.0f}" if len(b) > least else "" for b in bins)


def print_weights(weights, kind, prefix, terms):
    """As the program's source has them."""
    print(f"\nconstexpr {kind} {prefix}Weights = {{" + ", ".join(f"{w:.3f}f" for w in weights[:-1]) + "};")
    print(f"constexpr float {prefix}Constant = {weights[-1]:.3f}f;  // " + ", ".join(terms))
