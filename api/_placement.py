"""Common base of all results: a setup in a scene, with its pictures, pages and exports."""

import base64
from collections.abc import Iterable, Sequence
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._errors import input_errors
from ._pictures import Picture, drawn
from .coverage.rings.ring import Setup
from .objectives.dark_clothing import judge_dark, verify_dark
from .objectives.scene import Scene
from .objectives.verified import Verified
from .objectives.verify import Verifier
from .objectives.verify_breakdown import mean_by_part
from .reporting.lines.detection import detected_text
from .reporting.text import coverage_caption, with_error

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
        from .reporting.placement_picture import placement_picture

        what = self.scene, self.setup, self.captions()
        return drawn(lambda file: placement_picture(file, *what), path)

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
        price = self.scene.price_of(self.setup)
        return None if price is None else price.total

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


class Counted(Placement):
    """A setup whose coverage is counted."""

    each: tuple[Verified, ...]
    """One record for each target, with its poses."""
    verifier: Verifier | None
    """The counter; by default one with voxels of 0.01 m."""

    @property
    def coverage(self) -> float:
        """ζ in [0, 1]: the weighted mean over targets and poses, or the ζ of the worst pose if the
        scene has ``over_poses="worst"``. For an interval it is the middle.
        """
        return self._verifier.judged(self.each)[1]

    @property
    def dark_clothing(self) -> float | None:
        """``coverage`` with the sensors' range on dark clothing (17 %) at their light; None if a
        sensor has no figures of a catalogue, and for an interval.
        """
        return judge_dark(self._verifier, self._dark)

    @cached_property
    def _dark(self) -> tuple[Verified | None, ...]:
        goals = self.scene.targets
        with input_errors():
            return tuple(verify_dark(self._verifier, self.setup, g.target) for g in goals)

    @property
    def error(self) -> float | None:
        """Computed error of ``coverage``, in [0, 1]: 3.3 standard deviations, so it holds in 99.9 %
        of cases; half of the interval if that is guaranteed; None for the rules ``centre`` and
        ``touch``, whose error is not known.
        """
        return self._verifier.judged_error(self.each)

    @property
    def by_target(self) -> dict[str, float]:
        """ζ in [0, 1] of each target, by its name, such as ``V_S(0.5)``."""
        return {str(v.target): v.zeta for v in self.each}

    @cached_property
    def by_part(self) -> dict[str, float]:
        """ζ in [0, 1] of the rings, the single sensors and the sensors of the cell alone: the
        weighted mean over the targets. Empty unless there are several of these, and for an
        interval.
        """
        return mean_by_part(self._verifier, self.setup, self.each)

    def captions(self) -> list[str]:
        return [
            coverage_caption(str(v.target), 100 * v.zeta, None if d is None else 100 * d.zeta)
            for v, d in zip(self.each, self._dark, strict=True)
        ]

    def rows(self) -> Iterable[Sequence[str]]:
        for v in self.each:
            interval = f"{100 * v.low:.4f} … {100 * v.high:.4f} %"
            counted = f"{with_error(100 * v.zeta, v.error)} %"
            yield str(v.target), interval if v.rule == "certified" else counted
            if v.detection is not None:
                name = v.detection.question.piece.name
                yield f"{v.target}, {name} detected", f"{detected_text(v.detection)} %"
        for dark in filter(None, self._dark):
            yield f"{dark.target}, dark clothing", f"{100 * dark.zeta:.2f} %"
        if len(self.each) > 1:
            yield "weighted mean", f"{with_error(100 * self.coverage, self.error)} %"
        yield from self._criterion_rows()
        for part, zeta in self.by_part.items():
            yield f"{part} alone", f"{100 * zeta:.2f} %"
        prices, price = self.scene.prices, self.price
        if prices is not None and price is not None:
            yield "price", prices.text(price)

    def _criterion_rows(self) -> Iterable[Sequence[str]]:
        """Return the rows about another criterion than coverage."""
        return ()

    @cached_property
    def _verifier(self) -> Verifier:
        return self.verifier or Verifier(self.scene)
