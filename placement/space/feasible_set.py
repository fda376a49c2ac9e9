"""Feasible set of ring places: the link segments that the rules leave free, and the sensors that
fit."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Group, Ring, Setup
from ...objectives.feasibility.board_fit import board_of, fitting_tilts, most_wired, unwired
from ...objectives.feasibility.clearance import MountClearance
from ...objectives.link_segments import (
    Room,
    Segment,
    fits,
    most_rings,
    near_segments,
    segments,
)
from ...objectives.scene import Scene
from .collisions import Collisions

MOST_RINGS = 64  # free rings in a search that chooses counts: work and memory grow with them
_ROUNDING = 1e-6  # m, rounding of a radius in files
Rng = np.random.Generator


class InfeasibleError(ValueError):
    """Raised for rules that no setup can satisfy; the message names the key of the scene file and
    the reason."""

    def __init__(self, text: str, key: str = "rules") -> None:
        super().__init__(f"{key}: {text}")
        self._given = text, key

    def __reduce__(self) -> tuple[type["InfeasibleError"], tuple[str, str]]:
        return type(self), self._given


class FeasibleSet:
    """Places for rings that a scene's rules allow, for the rings of a layout or for a number of
    sensors in any rings."""

    def __init__(
        self,
        scene: Scene,
        layout: Setup | None = None,
        sensors: int | None = None,
        rings: int | None = None,
        each: int | None = None,
    ) -> None:
        """Pass either ``layout``, or ``sensors``, or ``rings`` with ``sensors`` or ``each``.

        The scene's fixed rings count among ``sensors`` and ``rings``, not among the layout's; its
        single sensors and those of the cell count in none of these.

        Args:
            scene: robot, poses, limits, rules.
            layout: the rings whose links and counts are kept.
            sensors: number of sensors, in any rings.
            rings: number of rings; by default the search chooses it.
            each: number of sensors on every new ring, with ``rings``.

        Raises:
            InfeasibleError: if no setup satisfies the rules.
        """
        self.scene, self.layout = scene, layout
        self._given = layout.rings if layout else ()
        self.clear = MountClearance(_with_sensors_of(scene, layout)) if scene.real else None
        self.radii = {link: self._radius(link) for link in scene.robot.links}
        self._tilts = dict[tuple[str, int], tuple[float, float] | None]()
        self.segments = segments(scene, self._rooms_of_bodies())
        self._near = near_segments(self.segments)
        self.fixed = scene.rules.fixed
        self.collisions = Collisions(self.clear, self.radii, self.fixed) if self.clear else None
        links = list(self.radii)
        self.link_of = np.array([links.index(s.link) for s in self.segments], int)
        """Number of each segment's link."""
        self.held: tuple[Group, ...] = (*self.fixed, *scene.standing)
        held = sum(ring.count for ring in self.fixed)
        self.rings = None if rings is None else rings - len(self.fixed)
        """Number of new rings; None: any."""
        self.free = layout.sensors if layout else (sensors or 0) - held
        if each is not None:
            self.free = (self.rings or 0) * each
        self.sensors = self.free + held
        given = () if layout is None else layout.groups
        self.possible = (*scene.sensors, *(group.sensor for group in given))
        """Sensors that setups may have."""
        self.square = scene.square or not all(ring.sensor.plain for ring in self._given)
        self.least, self.most = scene.rules.sensors if each is None else (each, each)
        if scene.rules.shared_tilt and self._shared_tilt()[1] < 0:
            raise InfeasibleError(
                "a shared tilt needs limits that allow a tilt and its opposite on every link"
            )
        if layout is None:
            self._check_electronics()
            largest = self.largest()
            self.places = min(len(largest), max(self.free, 0) // self.least)
            if rings is None:
                _check_budget(self, largest, held)
            else:
                sizes = None if each is None else FeasibleSet(scene, sensors=held).largest()
                numbers = rings, len(self.fixed), self.sensors, held, self.least, largest
                if reason := refusal(*numbers, equal=sizes):
                    raise InfeasibleError(reason + self.barred())
                self.places = rings - len(self.fixed)
            self.most = max(largest, default=self.most)
        else:
            self.places = len(layout.rings)
            _check_layout(self, layout)

    def _radius(self, link: str) -> float:
        """Return the radius of new rings on ``link``, m: the layout's or the scene's, enlarged as
        in ``MountClearance.radius``."""
        like = next((r.radius for r in self._given if r.link == link), None)
        if self.clear is None:
            return self.scene.radius_of(link) if like is None else like
        stated = self.scene.stated_radius(link) is not None
        return like if stated and like is not None else self.clear.radius(link, like or 0.0)

    def _rooms_of_bodies(self) -> dict[str, Room] | None:
        """Return the room of each link for real rings; None where rings have no bodies.

        Raises:
            InfeasibleError: if the radius is too small for a ring to close around a link that may
                carry one.
        """
        if self.clear is None:
            return None
        links = [ring.link for ring in self._given]
        if self.layout is None:
            links = [s.link for s in segments(self.scene)]
        for link in self.scene.robot.links:
            least = self.scene.least_radius(link)
            if link in links and self.radii[link] < least - _ROUNDING:
                own = self.scene.limits_of(link).radius is not None
                key = f"mounts.{link}.ring_radius" if own else "ring_radius"
                raise InfeasibleError(
                    f"{self.radii[link]:g} m is too small: a real ring on {link} needs at least"
                    f" {least:g} m with standoff {self.scene.rules.standoff:g}; raise the radius"
                    ' or set mount = "free"',
                    key,
                )
        return self.clear.rooms(self.radii, self.scene.rules.fixed)

    def barred(self, link: str | None = None) -> str:
        """Return the reason why no real ring fits on ``link``, or on the links without room, as the
        end of a sentence."""
        if self.clear is None:
            return ""
        each = () if link else self.segments
        wired = [most_wired(self.scene, self.ring(s.link, 1)) for s in each]
        few = [n for n in wired if n is not None and n < self.scene.rules.sensors[1]]
        least = f" (electronics: at most {min(few)} sensors on a ring)" if few else ""
        links = (
            [link] if link else [x for x, r in self.radii.items() if not self.clear.stretches(x, r)]
        )
        why = "; ".join(text for x in links if (text := self.clear.why(x, self.radii[x])))
        return least + (f" (rules.mount is real: {why})" if why else "")

    def _check_electronics(self) -> None:
        """Refuse a search in which no ring can carry the fewest sensors.

        Raises:
            InfeasibleError: if that is so.
        """
        links = dict.fromkeys(s.link for s in self.segments) if self.free > 0 else {}
        texts = [unwired(self.scene, self.ring(link, self.least)) for link in links]
        if texts and all(texts):
            raise InfeasibleError(texts[0], "electronics")

    def tilts(self, link: str, count: int) -> tuple[float, float] | None:
        """Return the lowest and highest tilt, rad, of a ring of ``count`` sensors on ``link``; None
        if their boards do not fit."""
        key = (link, count)
        if key not in self._tilts:
            self._tilts[key] = fitting_tilts(self.scene, self.ring(link, int(count)))
        return self._tilts[key]

    def most_on(self, link: str) -> int:
        """Return the largest sensor count of a ring on ``link`` that rules and boards allow; 0 if
        no ring fits."""
        return next((n for n in range(self.most, 0, -1) if self.tilts(link, n) is not None), 0)

    def room(self, used: Sequence[int], link: str | None = None, count: int = 0) -> list[int]:
        """Return the segments (of ``link``, if given) with room for one more ring of ``count``
        sensors besides the rings on the segments ``used``."""
        rings = [self.segments[i].link for i in used if i >= 0]
        most = self.scene.rules.max_rings_per_link
        held = [ring.link for ring in self.fixed]
        return [
            i
            for i, s in enumerate(self.segments)
            if (link is None or s.link == link)
            and list(used).count(i) < s.room
            and (i not in self._near or fits(self.segments, [*used, i]))
            and rings.count(s.link) + held.count(s.link) < most
            and (not count or self.tilts(s.link, count) is not None)
        ]

    def _rooms(self) -> dict[str, int]:
        """Return the number of rings that fit on each link besides the fixed ones."""
        most, held = self.scene.rules.max_rings_per_link, [ring.link for ring in self.fixed]
        return {
            link: most_rings(self.segments, link, max(most - held.count(link), 0))
            for link in dict.fromkeys(s.link for s in self.segments)
        }

    def largest(self) -> list[int]:
        """Return the largest sensor count of each free ring that fits, in descending order."""
        sizes = [
            n
            for link, room in self._rooms().items()
            for n in [self.most_on(link)] * room
            if n >= self.least
        ]
        return sorted(sizes, reverse=True)[:MOST_RINGS]

    @property
    def totals(self) -> list[int]:
        """All feasible totals of sensors, fixed rings included, in ascending order."""
        held, most = self.sensors - self.free, np.cumsum([0, *self.largest()]).tolist()
        each = (
            range(n * self.least, m + 1)
            for n, m in enumerate(most)
            if (n or held) and self.rings in (None, n)
        )
        return sorted({held + n for some in each for n in some})

    def _shared_tilt(self) -> tuple[float, float]:
        """Return the bounds of the tilt that all rings share up to its sign, rad."""
        tilts = [self.scene.limits_of(s.link).tilt for s in self.segments]
        return 0.0, min((min(-low, high) for low, high in tilts), default=0.0)

    def pick(self, rng: Rng, free: Sequence[int]) -> int:
        """Draw one of the segments ``free`` with a probability proportional to its length."""
        size = np.array([segment_length(self.scene, self.segments[i]) for i in free])
        return int(rng.choice(free, p=size / size.sum()))

    def limits(
        self, segment: int | np.integer, count: int
    ) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
        """Return the lower and upper bounds of a ring's values: place in the free interval, tilt
        rad, phase rad.

        A phase may turn by one sensor spacing either way; beyond that it repeats.
        """
        s = self.segments[segment]
        tilt, turn = (
            self.tilts(s.link, count) or self.scene.limits_of(s.link).tilt,
            2 * math.pi / count,
        )
        if self.scene.rules.shared_tilt:
            shared = self._shared_tilt()
            tilt = shared[0], min(shared[1], -tilt[0], tilt[1])
        return np.array([0.0, tilt[0], -turn]), np.array([float(s.loose), tilt[1], turn])

    def ring(self, link: str, count: int) -> Ring:
        """Return a new ring of ``count`` sensors at the start of ``link``."""
        own = self.scene.sensor_of(link)
        sensor = next((r.sensor for r in self._given if r.link == link), own)
        return Ring(link, 0.0, count, 0.0, 0.0, self.radii[link], sensor)


def segment_length(scene: Scene, s: Segment) -> float:
    """Return the length of a segment, m; that of one without room to move counts as 0.1."""
    return max((s.high - s.low) * scene.robot.mount(s.link).length, 0.1)


def _with_sensors_of(scene: Scene, layout: Setup | None) -> Scene:
    """Return the scene in which the new rings of a link have the sensor of the layout there."""
    limits = dict(scene.mounts)
    for ring in reversed(layout.rings if layout else ()):
        limits[ring.link] = replace(scene.limits_of(ring.link), sensor=ring.sensor)
    return replace(scene, mounts=limits)


def _check_budget(space: FeasibleSet, each: list[int], held: int) -> None:
    asked, least = _counted(space.sensors, "sensor"), space.least
    beside = f" besides the {held} of the fixed rings" if held else ""
    size = "of any size" if not each else f"of {least} to {each[0]} sensors, as boards fit"
    reason = None
    if space.free < 0:
        reason = f"are fewer than the {held} of the fixed rings; request more"
    elif 0 < space.free < least:
        reason = f"leave {space.free}{beside}, too few for a ring, which needs at least {least}"
    elif space.free > sum(each):
        most = (
            f", the most that a search places free{beside}" if len(each) == MOST_RINGS else beside
        )
        reason = f"do not fit: there is room for {len(each)} rings {size}{most}{space.barred()}"
    elif space.free and space.sensors not in space.totals:
        reason = f"cannot be divided into rings {size}{beside}; request another number"
    if reason:
        raise InfeasibleError(f"{asked} {reason}")


def refusal(
    rings: int,
    fixed: int,
    sensors: int,
    held: int,
    least: int,
    largest: Sequence[int],
    equal: Sequence[int] | None = None,
) -> str | None:
    """Return why a number of rings cannot be placed, in one line; None if they can.

    Args:
        rings: requested rings, ``fixed`` ones included.
        fixed: fixed rings.
        sensors: requested sensors, those that the fixed rings hold included.
        held: sensors of the fixed rings.
        least: fewest sensors of a new ring.
        largest: largest sensor count of each new ring that fits, in descending order.
        equal: where all new rings must have ``least`` sensors: that without this rule.
    """
    free, requested = rings - fixed, _counted(rings, "ring")
    fewest, most = held + free * least, held + sum(largest[: max(free, 0)])
    if free < 0:
        return f"{requested} are fewer than the {fixed} fixed ones; request more"
    if free > len(largest):
        beside = f" besides the {fixed} fixed ones" if fixed else ""
        fit = equal[free - 1] if equal and free <= len(equal) else 0
        return (
            f"{requested} of {'at least ' * (equal is None)}{least} sensors do not fit: there is"
            f" room for {len(largest)}{beside}"
            + (f"; rings of at most {fit} sensors fit" if fit else "")
        )
    if not fewest <= sensors <= most:
        return (
            f"{_counted(sensors, 'sensor')} do not fit on {requested}; allowed: {fewest} to {most}"
        )
    return None


def _counted(n: int, name: str) -> str:
    return f"{n} {name}" if n == 1 else f"{n} {name}s"


def _check_layout(space: FeasibleSet, layout: Setup) -> None:
    used: list[int] = []
    for ring in sorted(layout.rings, key=lambda r: r.link):
        free = space.room(used, ring.link)
        if not free:
            n = sum(r.link == ring.link for r in layout.rings)
            beside = f"limits, keep-outs, spacing and fixed rings{space.barred(ring.link)}"
            raise InfeasibleError(f"no room for {n} rings on {ring.link} within its {beside}")
        used.append(free[0])
        if text := unwired(space.scene, space.ring(ring.link, ring.count)):
            raise InfeasibleError(f"{ring.link}: {text}", "electronics")
        if space.tilts(ring.link, ring.count) is None:
            raise InfeasibleError(_too_many(space, ring))


def _too_many(space: FeasibleSet, ring: Ring) -> str:
    ring = space.ring(ring.link, ring.count)
    board, most = board_of(space.scene, ring.sensor), ring.count
    while most and space.tilts(ring.link, most) is None:
        most -= 1
    size = f"{1000 * board.width:.4g} × {1000 * board.height:.4g} mm" if board else ""
    return (
        f"{ring.count} boards of {size} do not fit around {ring.link} at radius {ring.radius:g} m:"
        f" at most {most} do"
    )
