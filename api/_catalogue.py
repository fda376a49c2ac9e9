"""Catalogues of commercial sensors and built-in robots."""

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from typing import TypeVar

from ._errors import InputError
from .coverage.robots.built_in import ROBOTS
from .coverage.robots.robot import Robot
from .coverage.sensors.catalogue import MODELS
from .coverage.sensors.effective_range import Use
from .coverage.sensors.sensor import Sensor, effective

T = TypeVar("T")


class _Catalogue(Mapping[str, T]):
    """Values by name."""

    _kind: str
    _known: Mapping[str, object]

    def __getitem__(self, name: str) -> T:
        if name not in self._known:
            raise KeyError(f"unknown {self._kind} {name!r}; known: {', '.join(self)}")
        return self._of(name)

    @abstractmethod
    def _of(self, name: str) -> T:
        """Return the value of a name that is known."""

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)

    def __repr__(self) -> str:
        return f"<{len(self)} {self._kind}s: {', '.join(self)}>"


class SensorCatalogue(_Catalogue[Sensor]):
    """Commercial sensors by name, with beam, zones and range from their datasheets.

    Example:
        >>> import place_rings as pr
        >>> pr.sensors["vl53l5cx"].zones
        8
        >>> "vl53l1x" in pr.sensors
        True
    """

    _kind, _known = "sensor", MODELS

    def _of(self, name: str) -> Sensor:
        return effective(Use(name)).sensor

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


class RobotCatalogue(_Catalogue[Robot]):
    """Built-in robots by name; ``load`` reads other robots from files.

    Example:
        >>> import place_rings as pr
        >>> pr.robots["ur10e"].links
        ('upper_arm', 'forearm', 'tool')
    """

    _kind, _known = "robot", ROBOTS

    def _of(self, name: str) -> Robot:
        return ROBOTS[name]


sensors = SensorCatalogue()
robots = RobotCatalogue()
