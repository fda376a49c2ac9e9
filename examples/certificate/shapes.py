"""The shapes of a certificate of coverage, with NumPy only; check.py explains what they are for.

Of body i and places x (..., 3) m: ``value`` is 1-Lipschitz, at most 0 in the body and above 0
outside. Of a round body: ``ball`` is the middle and the radius of a ball in the body, ``normals``
are directions, and no point p of the body within h of x has n . p above ``furthest``.
"""

import numpy as np
from statement import RIGHT, numbers, sizes, units, vectors


def dot(a, b):
    return (a * b).sum(-1)


def norm(a):
    return np.sqrt(dot(a, a))


def unit(a):
    return a / np.maximum(norm(a), 1e-12)[..., None]


class Capsules:
    """Points within a radius of segments."""

    def __init__(self, start, end, radius):
        self.a, self.b = vectors(start, end)
        self.r = sizes(radius, len(self.a))

    def value(self, i, x):
        return norm(x - self.ball(i, x)[0]) - self.r[i]

    def ball(self, i, x):
        v, w = x - self.a[i], self.b[i] - self.a[i]
        t = np.clip(dot(v, w) / np.maximum(dot(w, w), 1e-24), 0, 1)
        return self.a[i] + t[..., None] * w, self.r[i]

    def normals(self, i, x):
        return [unit(x - self.ball(i, x)[0])]

    def furthest(self, i, n, x, h):
        return np.maximum(dot(n, self.a[i]), dot(n, self.b[i])) + self.r[i]


class Shadows(Capsules):
    """What capsules hide from an apex: all apex + s (c - apex) with c in the capsule and s >= 1."""

    def __init__(self, apex, start, end, radius):
        super().__init__(start, end, radius)
        self.apex, every = apex, np.arange(len(apex))
        self.gap = norm(apex - Capsules.ball(self, every, apex)[0]) - self.r
        if not (self.gap > 0).all():
            raise ValueError("a sensor lies in a body")

    def nearest(self, i, x):
        """The place on the line of sight that is nearest to the axis, and that on the axis."""
        u, v, w = x - self.apex[i], self.b[i] - self.a[i], self.apex[i] - self.a[i]
        uu, uv, vv = np.maximum(dot(u, u), 1e-24), dot(u, v), np.maximum(dot(v, v), 1e-24)
        t = (uv * dot(v, w) - dot(u, w) * vv) / np.maximum(uu * vv - uv * uv, 1e-24)
        s = np.clip((uv * np.clip(t, 0, 1) + dot(v, w)) / vv, 0, 1)
        return np.clip((uv * s - dot(u, w)) / uu, 0, 1)[..., None], self.a[i] + s[..., None] * v

    def value(self, i, x):
        t, c = self.nearest(i, x)
        return norm(self.apex[i] + t * (x - self.apex[i]) - c) - self.r[i]

    def ball(self, i, x):
        t, c = self.nearest(i, x)
        t = np.maximum(t, 1e-6)
        return self.apex[i] + (c - self.apex[i]) / t, self.r[i] / t[..., 0]

    def normals(self, i, x):
        """That of the ball, then those of planes from the apex that touch the mantle and the balls
        at the ends of the axis."""
        v, w = x - self.apex[i], unit(self.b[i] - self.a[i])
        found = super().normals(i, x)
        for end, along in ((self.a, w), (self.a, 0 * w), (self.b, 0 * w)):
            e = end[i] - self.apex[i]
            e = e - dot(e, along)[:, None] * along
            side = v - dot(v, along)[:, None] * along
            side = unit(side - (dot(side, e) / np.maximum(dot(e, e), 1e-24))[:, None] * e)
            sine = np.minimum(self.r[i] / np.maximum(norm(e), 1e-12), 1)[:, None]
            found.append(np.sqrt(1 - sine**2) * side - sine * unit(e))
        return found

    def furthest(self, i, n, x, h):
        at = dot(n, self.apex[i])
        past, most = super().furthest(i, n, x, h) - at, (norm(x - self.apex[i]) + h) / self.gap[i]
        return at + past * np.where(past > 0, np.maximum(most, 1), 1)


class Cones:
    """Cones with flat ends, by half angles and lengths along the axis."""

    def __init__(self, apex, axis, half, length):
        (self.apex, _), (self.axis,) = vectors(apex, axis), units(axis)
        self.h, self.r = sizes(half, len(self.apex), RIGHT), sizes(length, len(self.apex))

    def place(self, i, x):
        d = dot(x - self.apex[i], self.axis[i])
        return d, norm(x - self.apex[i] - d[..., None] * self.axis[i])

    def value(self, i, x):
        d, rho = self.place(i, x)
        return np.maximum(rho * np.cos(self.h[i]) - d * np.sin(self.h[i]), d - self.r[i])

    def ball(self, i, x):  # in the cone without its end
        d, rho = self.place(i, x)
        d = np.maximum(d + rho * np.tan(self.h[i]), 0)
        return self.apex[i] + d[:, None] * self.axis[i], d * np.sin(self.h[i])

    normals = Capsules.normals

    def furthest(self, i, n, x, h):
        d = dot(n, self.axis[i])
        rim = d + norm(n - d[..., None] * self.axis[i]) * np.tan(self.h[i])
        return dot(n, self.apex[i]) + np.maximum(self.r[i] * rim, 0)


class Polyhedra:
    """Points p with n . p <= d for all planes of a body."""

    def __init__(self, normal, offset):
        self.n = np.zeros((len(offset), max(map(len, offset), default=1), 3))
        self.d = np.full(self.n.shape[:2], 1e6)  # of planes that only fill the array
        for k, (n, d) in enumerate(zip(normal, offset, strict=True)):
            (n,), d = vectors(n), numbers(d)
            size = norm(n)
            if d.shape != size.shape or not (size > 1e-3).all():
                raise ValueError("found a plane without a normal")
            self.n[k, : len(d)], self.d[k, : len(d)] = n / size[:, None], d / size

    def value(self, i, x):
        return (dot(x[..., None, :], self.n[i]) - self.d[i]).max(-1)

    def shadow(self, k, apex):
        """The planes of all apex + s (p - apex) with p in body k and s >= 1; s is eliminated."""
        real = norm(self.n[k]) > 0
        n, d = self.n[k][real], self.d[k][real]
        past = n @ apex - d
        if not (past > 1e-6).any():
            raise ValueError("a sensor lies in an obstacle")
        i, j = np.nonzero((past[:, None] > 0) & (past <= 0))
        part = (past[i] / (past[i] - past[j]))[:, None]
        edge = part * n[j] + (1 - part) * n[i]
        thick = norm(edge) > 1e-9  # planes back to back hide nothing more, unless they are crossed
        if (d[i] + d[j] < 0)[~thick].any():
            raise ValueError("found an obstacle without a place in it")
        edge = unit(edge[thick])
        return np.vstack([n[past > 0], edge]), np.append(d[past > 0], edge @ apex)


def pyramids(apex, axis, up, half, half_up, length):
    """Pyramids with flat ends: a plane across the axis, and four through the apex."""
    (apex, _), (axis, up), normal, offset = vectors(apex, axis), units(axis, up), [], []
    half, half_up = (sizes(h, len(apex), RIGHT) for h in (half, half_up))
    for p, a, u, r, *angles in zip(apex, axis, up, sizes(length, len(apex)), half, half_up):
        ways = [(sign * w, h) for w, h in zip((np.cross(u, a), u), angles) for sign in (1, -1)]
        normal.append([a, *(np.cos(h) * w - np.sin(h) * a for w, h in ways)])
        offset.append(np.array(normal[-1]) @ p + [r, 0, 0, 0, 0])
    return Polyhedra(normal, offset)
