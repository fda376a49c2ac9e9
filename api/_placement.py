"""Common base of all results: a setup in a scene, with its pictures, pages and exports."""

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._pictures import Picture, picture
from ._scene import Scene
from .coverage.rings.ring import Setup
from .objectives.verified import Verified
from .reporting.text import coverage_caption

if TYPE_CHECKING:
    from ._views import View


class Placement:
    """A setup in a scene: the common base of all results."""

    setup: Setup
    """The rings."""
    scene: Scene
    """Scene of the setup."""
    name: str
    """Name of the setup."""

    def captions(self) -> list[str]:
        """Return the title of the picture, one text for each target."""
        return []

    def plot(self, path: str | Path | None = None) -> Picture:
        """Draw the robot, the rings, the beams and the uncovered points from two sides.

        Args:
            path: path of a PNG file; by default no file is written.

        Returns:
            The picture, 1800 × 900 pixels.

        Raises:
            InputError: if the file cannot be written.
        """
        return picture(self.scene, self.setup, self.captions(), path)

    def report(self, folder: str | Path = "place-rings-report", **options: Any) -> Path:
        """Write the report, one HTML page; see ``place_rings.report``."""
        from ._report import report

        return report(self, folder=folder, **options)

    def view(self, **options: Any) -> "View":
        """Show the setup in a browser; see ``place_rings.view``."""
        from ._views import view

        return view(self, **options)

    def export(
        self, *to: str, folder: str | Path = "place-rings-export", **options: Any
    ) -> tuple[Path, ...]:
        """Write files for other programs; see ``place_rings.export``."""
        from ._export import export

        return export(self, to=to, folder=folder, **options)

    @property
    def price(self) -> float | None:
        """Price of all new rings with their sensors; None if the scene has no prices."""
        return self.scene.core.price_of(self.setup)

    def price_rows(self) -> Iterable[Sequence[str]]:
        prices, price = self.scene.core.prices, self.price
        if prices is not None and price is not None:
            yield "price", prices.text(price)

    def rows(self) -> Iterable[Sequence[str]]:
        """Return name and value of each line of the printed result."""
        return ()

    def __repr__(self) -> str:
        rows = [f"  {name}: {value}" for name, value in self.rows()]
        head = f"{type(self).__name__} of {self._what()}"
        return "\n".join([head, *rows])

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>"
            for name, value in self.rows()
        )
        data = base64.b64encode(self.plot().png).decode()
        return (
            f"<b>{escape(type(self).__name__)}</b> of {escape(self._what())}<table>{rows}</table>"
            f'<img width="900" alt="the setup from two sides" src="data:image/png;base64,{data}">'
        )

    def _what(self) -> str:
        name = "" if self.name in ("setup", "proposal") else f"{self.name}: "
        rings, singles = len(self.setup.rings), len(self.setup.singles)
        where = [f"in {rings} ring{'s' * (rings != 1)}"] * (rings > 0)
        where += [f"{singles} of them single"] * (singles > 0)
        return f"{name}{self.setup.sensors} sensors {', '.join(where)}"


def dark_rows(dark: Iterable[Verified | None]) -> Iterable[Sequence[str]]:
    """Yield ζ of each target for dark clothing, where it is known."""
    for v in dark:
        if v is not None:
            yield f"{v.target}, dark clothing", f"{100 * v.zeta:.2f} %"


def part_rows(by_part: Mapping[str, float]) -> Iterable[Sequence[str]]:
    """Yield ζ of each part of a mixed system alone."""
    for part, zeta in by_part.items():
        yield f"{part} alone", f"{100 * zeta:.2f} %"


def dark_captions(each: Iterable[Verified], dark: Iterable[Verified | None]) -> list[str]:
    """Return ζ of each target as text, with that for dark clothing where it is known."""
    return [
        coverage_caption(str(v.target), 100 * v.zeta, None if d is None else 100 * d.zeta)
        for v, d in zip(each, dark, strict=True)
    ]
