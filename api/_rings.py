"""The rings that a search may choose from."""

from dataclasses import dataclass

from ._arguments import number, whole
from ._errors import InputError
from .objectives.mount_rules import Rules
from .objectives.named_layouts import ring_layout
from .objectives.scene import CoreScene
from .placement.space.design import Space

_RINGS_PER_LINK = 2
_SENSORS_PER_RING = 16  # default where the scene's rules allow it
# the rule of a scene that limits what an argument fixes
_LIMITED_BY = {"rings_per_link": "max_rings_per_link", "sensors_per_ring": "sensors_per_ring"}
_WITHIN_POINTS = 1.0


@dataclass(frozen=True)
class Rings:
    """Layouts that a search chooses from; see ``search``."""

    sensors: int | None = None
    """Number of sensors, in rings that the search chooses."""
    rings_per_link: int | None = None
    """Rings on each link of a fixed layout."""
    sensors_per_ring: int | None = None
    """Sensors on each ring."""
    reach: float | None = None
    """Coverage to reach with the fewest sensors, percent."""
    rings: int | None = None
    """Number of rings, on links that the search chooses."""
    fewest_rings: bool = False
    """Whether to find the fewest rings near the best coverage, as ``sensors`` alone does."""
    within_points: float | None = None
    """Largest loss of coverage for fewer rings, percentage points."""
    any_rings: bool = False
    """Whether ``sensors`` may use any number of rings."""

    @property
    def fewest(self) -> bool:
        """Whether the search is for the fewest rings."""
        return self.sensors is not None and self.rings is None and not self.any_rings

    def space(self, scene: CoreScene) -> Space | None:
        """Return the design space of a search; None if several searches follow each other.

        Raises:
            InfeasibleError: if the scene's rules admit no setup.
            InputError: for numbers that contradict each other or a rule of the scene.
        """
        self.check()
        if self.reach is not None or self.fewest:
            return None
        if self.sensors is not None:
            return Space(scene, sensors=self.sensors, rings=self.rings)
        count = self._count(scene)
        if self.rings is not None:
            return Space(scene, rings=self.rings, each=count)
        return Space(scene, ring_layout(scene, self.rings_per_link or _RINGS_PER_LINK, count))

    @property
    def within(self) -> float:
        """Largest loss of coverage for fewer rings, in [0, 1]."""
        return (_WITHIN_POINTS if self.within_points is None else self.within_points) / 100

    def _count(self, scene: CoreScene) -> int:
        """Return the number of sensors on each ring.

        Raises:
            InputError: for a number that the scene's rules do not allow.
        """
        (least, most), each = scene.rules.sensors, self.sensors_per_ring
        count = min(max(_SENSORS_PER_RING, least), most) if each is None else each
        if not least <= count <= most and (least, most) != Rules().sensors:
            raise InputError(
                f"found {count}, allowed: {least} to {most}, the scene's rules.sensors_per_ring",
                "sensors_per_ring",
            )
        if each is None and self.rings is not None:  # as many as the boards of all rings allow
            held = sum(ring.count for ring in scene.rules.fixed)
            sizes = Space(scene, sensors=held).largest()
            new = min(max(self.rings - len(scene.rules.fixed), 0), len(sizes))
            count = min([count, *sizes[:new]])
        return count

    def check(self) -> None:
        """Check the numbers.

        Raises:
            InputError: for numbers that are out of range or contradict each other.
        """
        reach, sensors = self.reach, self.sensors
        if reach is not None:
            number("reach", reach, "above 0 and below 100 (percent)")
        if reach is not None and not 0 < reach < 100:
            raise InputError(f"found {reach:g}, allowed: above 0 and below 100 (percent)", "reach")
        if reach is not None and sensors is not None:
            raise InputError(
                f"found {reach:g} with sensors {sensors}; use only one of them",
                "reach",
                others=("sensors",),
            )
        for name, value, most in (
            ("sensors", sensors, 2000),
            ("rings", self.rings, 1000),
            ("rings_per_link", self.rings_per_link, 200),
            ("sensors_per_ring", self.sensors_per_ring, 200),
        ):
            if value is not None:
                whole(name, value, 1, most)
            if name not in _LIMITED_BY or value is None or (sensors is None and reach is None):
                continue
            beside = "reach" if reach is not None else f"sensors {sensors}"
            raise InputError(
                f"found {value} with {beside}, where the search chooses the rings; use only one of"
                f" them, or set rules.{_LIMITED_BY[name]} in the scene",
                name,
                others=("reach", "sensors"),
            )
        self._check_rings()

    def _check_rings(self) -> None:
        """Check what is said about the number of rings."""
        if self.rings is not None and self.rings_per_link is not None:
            raise InputError(
                f"found {self.rings} with rings_per_link {self.rings_per_link}; use only one of"
                " them",
                "rings",
                others=("rings_per_link",),
            )
        within = self.within_points
        if within is not None:
            number("within", within, "0 or more and below 100 (percentage points)")
            if not 0 <= within < 100:
                raise InputError(
                    f"found {within:g}, allowed: 0 or more and below 100 (percentage points)",
                    "within",
                )
            if not self.fewest:
                raise InputError(
                    f"found {within:g}, allowed: only with sensors, without rings and any_rings",
                    "within",
                    others=("sensors", "any_rings", "rings"),
                )
        others = (("rings", self.rings), ("reach", self.reach))
        for name, stated in (("fewest_rings", self.fewest_rings), ("any_rings", self.any_rings)):
            for other, value in others if stated else ():
                if value is not None:
                    raise InputError(
                        f"found with {other} {value:g}; use only one of them", name, others=(other,)
                    )
            if stated and self.sensors is None:
                raise InputError(
                    "found without sensors; state their number", name, others=("sensors",)
                )
        if self.fewest_rings and self.any_rings:
            raise InputError(
                "found with any_rings; use only one of them", "fewest_rings", others=("any_rings",)
            )
