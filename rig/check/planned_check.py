"""A planned check: setup, scene and plans, as its recording stores them."""

from dataclasses import dataclass

from pydantic import ValidationError

from ...coverage.definitions.errors import explain
from ...coverage.rings.ring import Setup
from ...formats.schema.versions import FROM_FILE
from ...objectives.scene import Scene
from ..rings.line_monitor import Port
from ..simulated_cell.ground_truth import Injected, injected
from .models import AboutFile
from .plans import Plans


@dataclass(frozen=True)
class PlannedCheck:
    """A setup in a scene, and the plans of its check."""

    about: AboutFile
    """Header of the recording."""
    scene: Scene
    """Robot, cell and targets."""
    setup: Setup
    """The rings as proposed."""
    plans: Plans
    """The planned parts."""

    @staticmethod
    def of(about: AboutFile) -> "PlannedCheck":
        """Create the check that a header describes."""
        scene = about.proposal.scene.to_domain()
        plans = Plans(about.seconds, about.stops, tuple(about.trials), about.wave)
        return PlannedCheck(about, scene, about.proposal.setup(scene), plans)

    @staticmethod
    def read(name: str, content: object) -> "PlannedCheck":
        """Read the check from the table of a recording; raise UserError that names ``name`` if it
        is invalid.
        """
        try:
            return PlannedCheck.of(AboutFile.model_validate(content, context=FROM_FILE))
        except ValidationError as error:
            raise explain(name, error, AboutFile) from error

    @property
    def ports(self) -> list[Port]:
        """Ports of the rings."""
        return self.about.ports

    @property
    def injected(self) -> Injected | None:
        """Errors and faults of a simulated rig; None for a real one."""
        if not self.about.injected:
            return None
        return injected(self.scene, self.setup, self.about.seed, self.about.faults)


def ring_names(setup: Setup) -> list[str]:
    """Name each ring and single sensor by its link or, for a single sensor, by its own name; with
    its number among those of the same name if there are several."""
    names = [getattr(group, "name", "") or group.link for group in setup.groups]
    each: list[str] = []
    for i, name in enumerate(names):
        number = names[:i].count(name)
        one = name if names.count(name) == 1 else f"{name}.{number}"
        while one in each or (one != name and one in names):
            number += 1
            one = f"{name}.{number}"
        each.append(one)
    return each
