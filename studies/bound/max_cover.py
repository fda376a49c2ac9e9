"""Maximum coverage under a budget: upper bounds, and good choices of candidates.

Each candidate covers some points and costs some sensors. The problem asks for the choice within a
budget that covers most. As an integer programme, x_c says whether candidate c is taken and y_p
whether point p is covered:

        maximise sum w_p y_p,  y_p <= sum of x_c over the c that cover p,  y_p <= 1,
        sum cost_c x_c <= budget,

and at most a given number of candidates may be taken from some sets. With x in [0, 1] it is a
linear programme, whose value no choice exceeds (Nemhauser, Wolsey and Fisher 1978).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import sparse
from scipy.optimize import Bounds, LinearConstraint, linprog, milp

_OPTIMAL = 0  # SciPy's status code


@dataclass(frozen=True)
class CoverProblem:
    """C candidates, and M groups of points that are covered by the same candidates."""

    covers: Bool[np.ndarray, "C M"]
    """Whether a candidate covers a group."""
    weight: Float[np.ndarray, " M"]
    """Share of all points in each group."""
    cost: Int[np.ndarray, " C"]
    """Number of sensors of each candidate."""
    budget: int
    """Largest total cost."""
    limits: tuple[tuple[Int[np.ndarray, " _"], int], ...] = ()
    """Sets of candidates (indices), and how many of each set may be taken."""

    def share(self, taken: Int[np.ndarray, " _"]) -> float:
        """Return the share of all points that these candidates (indices) cover."""
        return float(self.weight[self.covers[taken].any(axis=0)].sum()) if len(taken) else 0.0

    def allowed(self, taken: Int[np.ndarray, " _"]) -> bool:
        """Return whether these candidates keep the budget and every limit."""
        return bool(self.cost[taken].sum() <= self.budget) and all(
            np.isin(taken, some).sum() <= most for some, most in self.limits
        )

    def constraints(self) -> tuple[sparse.csr_matrix, np.ndarray]:
        """Return A and b of A (x, y) <= b: a row for each group, the budget, and a row for each
        limit.
        """
        c, m = self.covers.shape
        rules = np.zeros((1 + len(self.limits), c))
        rules[0] = self.cost
        for row, (some, _) in zip(rules[1:], self.limits, strict=True):
            row[some] = 1
        groups = sparse.hstack(
            [-sparse.csr_matrix(self.covers.T.astype(float)), sparse.identity(m)]
        )
        both = sparse.vstack(
            [groups, sparse.hstack([sparse.csr_matrix(rules), sparse.csr_matrix((len(rules), m))])]
        )
        return both.tocsr(), np.concatenate(
            [np.zeros(m), [self.budget], [most for _, most in self.limits]]
        ).astype(float)


def grouped(
    covers: Bool[np.ndarray, "C N"],
) -> tuple[Bool[np.ndarray, "C M"], Float[np.ndarray, " M"]]:
    """Merge points that the same candidates cover; return the groups and their shares of all
    points.
    """
    packed, times = np.unique(np.packbits(covers, axis=0), axis=1, return_counts=True)
    found = np.unpackbits(packed, axis=0, count=len(covers)).astype(bool)
    seen = found.any(axis=0)
    return found[:, seen], times[seen] / covers.shape[1]


def greedy(choice: CoverProblem) -> Int[np.ndarray, " _"]:
    """Choose candidates one by one, each with the largest gain for its cost; or the best single
    one.

    For candidates of equal cost and without limits, this reaches 1 - 1/e of the best choice
    (Nemhauser, Wolsey and Fisher 1978); with costs, half of that (Khuller, Moss and Naor 1999).
    With limits it is only a lower bound.

    Returns:
        Indices of the candidates.
    """
    free = np.ones(choice.covers.shape[1], bool)
    taken: list[int] = []
    while True:
        gain = choice.covers[:, free] @ choice.weight[free]
        order = np.argsort(-gain / choice.cost, kind="stable")
        best = next(
            (i for i in order if gain[i] > 0 and choice.allowed(np.array([*taken, i]))), None
        )
        if best is None:
            break
        taken.append(int(best))
        free &= ~choice.covers[best]
    alone = [i for i in range(len(choice.cost)) if choice.allowed(np.array([i]))]
    single = np.array([max(alone, key=lambda i: choice.share(np.array([i])))] if alone else [], int)
    return max(np.array(taken, int), single, key=choice.share)


def certificate(
    choice: CoverProblem, pull: Float[np.ndarray, " M"], prices: Float[np.ndarray, " _"]
) -> float:
    """Return an upper bound of any choice's share from given multipliers.

    It holds for all multipliers, so it does not depend on a solver's tolerance.

    Args:
        choice: problem.
        pull: multipliers (M,) of y <= sum x for each group; clipped to 0 and the group's weight.
        prices: multipliers of the budget and of each limit, clipped at 0.
    """
    pull, prices = np.clip(pull, 0, choice.weight), np.maximum(prices, 0)
    worth = choice.covers @ pull - prices[0] * choice.cost
    for (some, _), price in zip(choice.limits, prices[1:], strict=True):
        worth[some] -= price
    held = prices[0] * choice.budget + sum(
        most * price for (_, most), price in zip(choice.limits, prices[1:], strict=True)
    )
    return float((choice.weight - pull).sum() + held + np.maximum(worth, 0).sum())


def relaxed(choice: CoverProblem, seconds: float) -> float:
    """Return the linear programme's upper bound, recomputed from its multipliers.

    It is weaker if the solver ran out of time.
    """
    c, m = choice.covers.shape
    a, b = choice.constraints()
    value = np.concatenate([np.zeros(c), -choice.weight])
    found = linprog(
        value, A_ub=a, b_ub=b, bounds=(0, 1), method="highs", options={"time_limit": seconds}
    )
    multipliers = -found.ineqlin.marginals if found.status == _OPTIMAL else np.zeros(len(b))
    total = float(choice.weight.sum())
    return min(certificate(choice, multipliers[:m], multipliers[m:]), total)


@dataclass(frozen=True)
class CoverSolution:
    """Result of the integer programme."""

    taken: Int[np.ndarray, " _"]
    """Indices of the best known choice."""
    bound: float
    """Upper bound of any choice's share."""
    optimal: bool
    """True if the best known choice reaches the bound."""


def solved(choice: CoverProblem, seconds: float) -> CoverSolution:
    """Solve the integer programme within at most ``seconds`` seconds."""
    c, m = choice.covers.shape
    a, b = choice.constraints()
    found = milp(
        np.concatenate([np.zeros(c), -choice.weight]),
        constraints=LinearConstraint(a, -np.inf, b),
        integrality=np.concatenate([np.ones(c), np.zeros(m)]),
        bounds=Bounds(0, 1),
        options={"time_limit": seconds, "mip_rel_gap": 1e-6},
    )
    taken = np.flatnonzero(found.x[:c] > 0.5) if found.x is not None else np.zeros(0, int)
    total = float(choice.weight.sum())
    dual = found.mip_dual_bound
    bound = total if dual is None or not np.isfinite(dual) else min(-float(dual), total)
    return CoverSolution(taken, bound, found.status == _OPTIMAL)
