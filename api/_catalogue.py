"""Catalogues of commercial sensors and built-in robots."""

from collections.abc import Iterator, Mapping

from ._errors import InputError
from .coverage.robots.built_in import ROBOTS
from .coverage.robots.robot import Robot
from .coverage.sensors.catalogue import MODELS
from .coverage.sensors.effective_range import Use
from .coverage.sensors.sensor import Sensor, effective


class SensorCatalogue(Mapping[str, Sensor]):
    """Commercial sensors by name, with beam, zones and range from their datasheets.

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
        name: str | Sensor,
        *,
        ambient: str | None = None,
        reflectance: float | None = None,
        target_size: tuple[float, float] | None = None,
    ) -> Sensor:
        """Return a sensor with its effective range under given conditions.

        Args:
            name: name of the sensor in the catalogue, or a sensor of the catalogue or of a sensor
                file, as ``load`` returns it.
            ambient: ambient light as the catalogue writes it, such as ``50kcps``; the darkest
                listed condition by default.
            reflectance: reflectance of the target in (0, 1]; the manufacturer's white target by
                default.
            target_size: width and height of the target, m; the target fills the beam by default.

        Returns:
            The sensor with the range under these conditions.

        Raises:
            InputError: for an unknown sensor, or a condition for which no source states a range.

        Example:
            >>> import place_rings as pr
            >>> round(pr.sensors.under("vl53l1x", ambient="50kcps").range_m, 2)
            1.62
        """
        if isinstance(name, str) and name not in MODELS:
            raise InputError(f"found {name}, allowed: {', '.join(MODELS)}", "sensor")
        use = name.use if isinstance(name, Sensor) else Use(name)
        if use is None:
            raise InputError("found a nominal beam, allowed: a sensor with a model", "sensor")
        try:
            return effective(Use(use.model, ambient, reflectance, target_size)).sensor
        except ValueError as error:
            raise InputError(str(error).removeprefix("Use: "), "sensor", use.name) from error


class RobotCatalogue(Mapping[str, Robot]):
    """Built-in robots by name; ``load`` reads other robots from files.

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
