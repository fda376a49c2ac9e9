"""Check a certificate of coverage, with NumPy only: python check.py FILE

It shares no code with the program that wrote the file. A certificate states shapes in metres, cubes
that fill all space near the robot, a claim on each cube, and an interval of coverage. The interval
is derived again from the shapes and the cubes, and no claim may contradict what follows from them.
Of a cube that a round body cuts, the share in the body is at least that in a ball inside the body,
and at most that in any half-space that holds the body. Of a half-space it has a closed form.
"""

import sys
from functools import reduce

import numpy as np
from shapes import Capsules, Cones, Polyhedra, Shadows, dot, norm, pyramids, unit
from statement import numbers, stated, units, vectors

EPS, ROUNDING = 1e-9, 1e-7  # m, and of a share: more than the rounding of what follows
LEVELS, CHUNK = 21, 512  # halvings from all space to the smallest cube; cubes at once
FULL = 9.0  # offset of a half-space that holds a whole cube, in sides; negative: none of it
OUTSIDE, COVERED, UNCOVERED, OPEN = range(4)


def both(a, b):
    return np.maximum(a[0] + b[0] - 1, 0), np.minimum(a[1], b[1])


def without(a):
    return 1 - a[1], 1 - a[0]


def under(n, low, high):
    """Bounds of the share of the unit cube about 0 in n . x <= d, for d from low to high."""
    n, found = abs(n), []
    for d in (low, high):
        t = d + n.sum(-1) / 2
        each = ((-1) ** sum(k) * np.maximum(t - n @ k, 0) ** 3 for k in np.ndindex(2, 2, 2))
        share = sum(each) / (6 * n.prod(-1))
        found.append(np.where(t >= n.sum(-1), 2, np.where(t > 0, share, -1)))
    return np.clip(found[0] - ROUNDING, 0, 1), np.clip(found[1] + ROUNDING, 0, 1)


def tilted(n):
    """Unit vectors without a zero near n, as ``under`` needs them."""
    return unit(np.where(abs(n) < 1e-4, 1e-4, n))


def half(own, d, x, s):
    """Bounds of the share of cubes with middles x and sides s in own . p <= d."""
    n, d = tilted(own), (d - dot(own, x)) / s
    off = abs(n - own).sum(-1) / 2 + EPS / s
    return under(n, d - off, d + off)


def round_shares(body, i, x, s, h):
    """Bounds of the share of cubes in round bodies. Then a normal, and offsets of half-spaces of
    which the smaller lies in the body, as far as the cube goes, and the larger holds it."""
    q, r = body.ball(i, x)
    first, *others = body.normals(i, x)
    n, away = tilted(first), np.maximum(norm(x - q), 1e-12)
    # for p of the cube: |p - q|^2 <= away^2 + 2 away first . (p - x) + h^2
    inner = ((r * r - away**2 - h * h) / (2 * away) - norm(n - first) * h - EPS) / s
    outer = (body.furthest(i, n, x, h) + EPS - dot(n, x)) / s
    low, high = under(n, inner, outer)
    for way in map(tilted, others):
        past = (body.furthest(i, way, x, h) + EPS - dot(way, x)) / s
        high = np.minimum(high, under(way, past, past)[1])
    if isinstance(body, Cones):
        end = dot(body.apex[i], body.axis[i]) + body.r[i]
        low, high = both((low, high), half(body.axis[i], end, x, s))
    return (low, high), n, inner, outer


def shares(body, i, x, s):
    """Bounds of the share of cubes in bodies i; of round bodies also what ``round_shares`` says."""
    value, h = body.value(i, x), 3**0.5 / 2 * s + EPS
    low, high = (value < -h).astype(float), (value < h).astype(float)
    n = np.ones((len(i), 3))
    inner, outer = np.where(low, FULL, -FULL), np.where(high, FULL, -FULL)
    cut = np.flatnonzero(low < high)
    i, x, s, h = i[cut], x[cut], s[cut], h[cut]
    if isinstance(body, Polyhedra):
        planes = zip(np.moveaxis(body.n[i], 1, 0), body.d[i].T)
        low[cut], high[cut] = reduce(both, (half(n, d, x, s) for n, d in planes))
    else:
        (low[cut], high[cut]), n[cut], inner[cut], outer[cut] = round_shares(body, i, x, s, h)
    return (low, high), n, inner, outer


def meeting(body, count, c, s):
    """All pairs of a cube and of those bodies that come near to any of the cubes."""
    middle, each = (c.min(0) + c.max(0)) / 2, np.arange(count)
    near = each[body.value(each, np.tile(middle, (count, 1))) <= (norm(c - middle) + s).max() + EPS]
    return np.repeat(np.arange(len(c)), len(near)), np.tile(near, len(c))


def union(cell, bounds, cells):
    low, high = np.zeros((2, cells))
    np.maximum.at(low, cell, bounds[0])
    np.add.at(high, cell, bounds[1])
    return low, np.minimum(high, 1)


def common(cell, n, inner, outer, cells):
    """One normal for each cell, the inner offsets of its pairs along it, and the largest outer one:
    a bound of a union in which bodies nearly coincide."""
    cut, first = np.flatnonzero(abs(outer) < FULL), np.zeros(cells, int)
    first[cell[cut]] = cut
    more = norm(n - n[first[cell]]) * np.where(abs(outer) < FULL, 0.87, 0)  # 0.87 > 3 ** 0.5 / 2
    most = np.full(cells, -FULL)
    np.maximum.at(most, cell, outer + more)
    return n[first], inner - more, most


def bodies(body, count, c, s):
    """Bounds of the share of cubes in a union of bodies."""
    cell, i = meeting(body, count, c, s)
    if not len(cell):
        return np.zeros((2, len(c)))
    found, *planes = shares(body, i, c[cell], s[cell])
    low, high = union(cell, found, len(c))
    if not isinstance(body, Polyhedra):
        n, _, most = common(cell, *planes, len(c))
        high = np.minimum(high, under(n, most, most)[1])
    return low, high


def tube(discs, normal, radius, first, c, s):
    """The same in slabs within a radius of segments, in which the signs of two discs' planes
    differ."""
    (discs, _), (normal,), first = vectors(discs, normal), units(normal), np.array(first)
    if first.dtype.kind != "i" or (first < 0).any():
        raise ValueError("found slabs between no discs")
    body = Capsules(discs[first], discs[first + 1], np.full(len(first), float(radius)))
    cell, i = meeting(body, len(first), c, s)
    if not len(cell):
        return np.zeros((2, len(c)))
    x, side, ends = c[cell], s[cell], (first[i], first[i] + 1)
    found, n, inner, outer = shares(body, i, x, side)
    behind, before = (half(-normal[k], -dot(discs[k], normal[k]), x, side) for k in ends)
    a, b = both(behind, without(before)), both(without(behind), before)
    wedge = np.maximum(a[0], b[0]), np.minimum(a[1] + b[1], 1)
    low, high = union(cell, both(found, wedge), len(c))
    n, inner, most = common(cell, n, inner, np.where(wedge[1] > 0, outer, -FULL), len(c))
    # along slabs from a disc on one side of a cube to one on the other, what all hold is inside
    signs = [(low == 1).astype(int) - (high == 0) for low, high in (behind, before)]
    best, last = np.full(len(c), -FULL), -9
    run = {1: best, -1: best}
    for slab, near, start, stop in zip(
        *(y.reshape(len(c), -1).T for y in (first[i], inner, *signs))
    ):
        for sign in (1, -1):
            held = run[sign] if slab[0] == last + 1 else -FULL
            run[sign] = np.minimum(near, np.where(start == sign, FULL, held))
            best = np.maximum(best, np.where(stop == -sign, run[sign], -FULL))
        last = slab[0]
    least, most = under(n, best, most)
    return np.maximum(low, least), np.minimum(high, most)


def solid(node, c, s):
    """Bounds of the share of cubes in a tree of unions, intersections and differences."""
    ((kind, value),) = node.items()
    if kind == "tube":
        return tube(**value, c=c, s=s)
    if kind == "capsules":
        return bodies(Capsules(**value), len(value["radius"]), c, s)
    if kind == "polyhedra":
        return bodies(Polyhedra(**value), len(value["offset"]), c, s)
    a, b = (solid(x, c, s) for x in value)
    if kind == "intersection":
        return both(a, b)
    if kind == "difference":
        return both(a, without(b))
    if kind == "union":
        return without(both(without(a), without(b)))
    raise ValueError(f"found a shape {kind!r}")


class Sight:
    """What sensors see past capsules and polyhedra."""

    def __init__(self, cones, pyramid, capsules, polyhedra):
        blocks, body, self.beams = Polyhedra(**polyhedra), Capsules(**capsules), []
        ends = list(zip(body.a, body.b, body.r))
        for beams, (apex,) in (
            (Cones(**cones), vectors(cones["apex"])),
            (pyramids(**pyramid), vectors(pyramid["apex"])),
        ):
            each = [[blocks.shadow(k, p) for p in apex] for k in range(len(blocks.d))]
            shadows = [Shadows(apex, *([v] * len(apex) for v in end)) for end in ends]
            shadows += [Polyhedra(*zip(*planes)) for planes in each if planes]
            self.beams.append((beams, len(apex), shadows))

    def __call__(self, c, s, by):
        """Bounds of the share of cubes, and the upper one of what sensor ``by`` alone sees."""
        seen, alone, first = np.zeros((2, len(c))), np.zeros(len(c)), 0
        for beams, count, shadows in self.beams:
            cell, i = meeting(beams, count, c, s)
            need = (by[cell] < 0) | (by[cell] == first + i)
            cell, i = cell[need], i[need]
            (low, high), *_ = shares(beams, i, c[cell], s[cell])
            for shadow in shadows:
                some = np.flatnonzero(high > 0)
                dark, *_ = shares(shadow, i[some], c[cell[some]], s[cell[some]])
                low[some] = np.maximum(low[some] - dark[1], 0)
                high[some] = np.minimum(high[some], 1 - dark[0])
            alone[cell[by[cell] >= 0]] = high[by[cell] >= 0]
            more = union(cell, (low, high), len(c))
            seen = np.maximum(seen[0], more[0]), np.minimum(seen[1] + more[1], 1)
            first += count
        return seen, alone


def cubes(level, side):
    """Middles and sides, m, of cubes that fill all space in order of their Morton keys."""
    if level.ndim != 1 or level.min() < 0 or level.max() > LEVELS:
        raise ValueError("found levels that are none")
    size = np.array([8**k for k in range(LEVELS + 1)], np.uint64)[level]
    key = np.cumsum(size) - size
    if (key % size).any() or sum(map(int, size)) != 8**LEVELS:
        raise ValueError("the cubes do not fill all space")
    bits, axes = (np.arange(k, dtype=np.uint64) for k in (LEVELS, 3))
    at = [((key[:, None] >> (3 * bits + axis)) & 1) @ (1 << bits) for axis in axes]
    sides = side * 2.0**level
    return side * (np.stack(at, -1) - 2.0 ** (LEVELS - 1)) + sides[:, None] / 2, sides


def beyond(side):
    """Middles and sides of cubes around those cubes, in shells of growing size."""
    at = np.array([k for k in np.ndindex(6, 6, 6) if not set(k) <= {2, 3}]) - 2.5
    for size in side * 2.0 ** (LEVELS - 1) * 3.0 ** np.arange(30):
        yield at * size, np.full(len(at), size)


def interval(item, level, claim, by):
    """Return the bounds of coverage of one target at one pose."""
    unit_side = float(numbers(item["unit"], 1e-9, 1))
    middle, side = cubes(level.astype(int), unit_side)
    if any(solid(item["target"], *shell)[1].any() for shell in beyond(unit_side)):
        raise ValueError("the target reaches beyond the cubes")
    sight, total = Sight(**item["sensors"]), np.zeros(4)
    for k in range(0, len(side), CHUNK):
        c, s, said = (a[k : k + CHUNK] for a in (middle, side, claim))
        target = solid(item["target"], c, s)
        seen, alone = sight(c, s, np.where(said == COVERED, by[k : k + CHUNK], -1))
        wrong = [
            target[0] > 0,
            (target[1] < 1) | (alone < 1),
            (target[1] < 1) | (seen[0] > 0),
            said > OPEN,
        ]
        if (false := np.choose(np.minimum(said, OPEN), wrong)).any():
            raise ValueError(f"cube {k + false.argmax()}: its claim is false")
        each = [*both(target, seen), *both(target, without(seen))]
        total += [np.sum(share * s**3) for share in each]
    low, high, unseen, most = total * [1 - 1e-9, 1 + 1e-9, 1 - 1e-9, 1 + 1e-9]
    return np.array([low / (low + most), high / (high + unseen)])


def main(path):
    with np.load(path, allow_pickle=False) as file:
        said, names = stated(str(file["statement"])), ("level", "claim", "by")
        items = said["items"]
        cells = [[file[f"{name}_{k}"] for name in names] for k in range(len(items))]
    for target, (least, most) in said["coverage"].items():
        of = [k for k, item in enumerate(items) if item["name"] == target]
        weights = [items[k]["weight"] for k in of]
        each = [w * interval(items[k], *cells[k]) for w, k in zip(weights, of)]
        low, high = sum(each) + np.array([-1e-12, 1e-12])
        ends = np.floor(1e6 * low) / 1e4, np.ceil(1e6 * high) / 1e4
        shown = f"{target}: {ends[0]:.4f} to {ends[1]:.4f} % proven"
        if not least <= low <= high <= most:
            raise ValueError(f"{shown}, stated {100 * least:.4f} to {100 * most:.4f} %")
        print(f"{shown}, within the stated {100 * least:.4f} to {100 * most:.4f} %")


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except Exception as error:  # whatever is wrong with a file, it is no proof
        sys.exit(f"refused: {type(error).__name__}: {error}")
