"""The catalogues: sensors that can be bought, and robots that are built in."""

from collections.abc import Iterator, Mapping

from ._errors import InputError
from .coverage.robots.built_in import ROBOTS
from .coverage.robots.robot import Robot
from .coverage.sensors.catalogue import MODELS
from .coverage.sensors.effective_range import effective
from .coverage.sensors.sensor import Sensor, Use


class SensorCatalogue(Mapping[str, Sensor]):
    """Sensors that can be bought, by name: beam, zones, and range as their makers state it.

    Example:
        >>> import place_rings as pr
        >>> pr.sensors["vl53l5cx"].zones
        8
        >>> "vl53l1x" in pr.sensors
        True
    """

    def __getitem__(self, name: str) -> Sensor:
        if name not in MODELS:
            raise KeyError(f"unknown sensor {name!r}; known: {', '.join(MODELS)}")
        return effective(Use(name)).sensor

    def __iter__(self) -> Iterator[str]:
        return iter(MODELS)

    def __len__(self) -> int:
        return len(MODELS)

    def __repr__(self) -> str:
        return f"<{len(self)} sensors: {', '.join(self)}>"

    def under(
        self,
        name: str,
        *,
        ambient: str | None = None,
        reflectance: float | None = None,
        target_size: tuple[float, float] | None = None,
    ) -> Sensor:
        """A sensor with the range that it has under given conditions.

        Args:
            name: of the catalogue.
            ambient: light as the catalogue writes it, like ``50kcps``; the darkest by default.
            reflectance: of the target, in (0, 1]; the maker's white target by default.
            target_size: width and height of the target, m; it fills the beam by default.

        Raises:
            InputError: for an unknown sensor, or a condition without a sourced figure.

        Example:
            >>> import place_rings as pr
            >>> round(pr.sensors.under("vl53l1x", ambient="50kcps").range_m, 2)
            1.61
        """
        if name not in MODELS:
            raise InputError(f"found {name}, allowed: {', '.join(MODELS)}", "sensor")
        try:
            return effective(Use(name, ambient, reflectance, target_size)).sensor
        except ValueError as error:
            raise InputError(str(error), "sensor", name) from error


class RobotCatalogue(Mapping[str, Robot]):
    """Robots that are built in, by name; ``load`` reads others from files.

    Example:
        >>> import place_rings as pr
        >>> pr.robots["ur10e"].links
        ('upper_arm', 'forearm', 'tool')
    """

    def __getitem__(self, name: str) -> Robot:
        if name not in ROBOTS:
            raise KeyError(f"unknown robot {name!r}; known: {', '.join(ROBOTS)}")
        return ROBOTS[name]

    def __iter__(self) -> Iterator[str]:
        return iter(ROBOTS)

    def __len__(self) -> int:
        return len(ROBOTS)

    def __repr__(self) -> str:
        return f"<{len(self)} robots: {', '.join(self)}>"


sensors = SensorCatalogue()
robots = RobotCatalogue()
