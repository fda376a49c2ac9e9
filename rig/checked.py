"""What a check is of, as its recording says it."""

from dataclasses import dataclass

from ..coverage.rings.ring import Setup
from ..formats.schema.ring_models import setup_of
from ..objectives.scene import Scene
from .check_models import AboutFile
from .plan_files import mount_plan_of, rod_plan_of
from .procedure import Plans
from .rings.health import Port
from .simulated_cell.injected import Injected, injected


@dataclass(frozen=True)
class Checked:
    """A setup in a scene, and what was planned."""

    about: AboutFile
    scene: Scene
    setup: Setup
    plans: Plans

    @staticmethod
    def of(about: AboutFile) -> "Checked":
        """All of it."""
        scene = about.proposal.scene.to_domain()
        stops = mount_plan_of(about.stops) if about.stops else None
        plans = Plans(about.seconds, stops, tuple(rod_plan_of(t) for t in about.trials), about.wave)
        return Checked(
            about, scene, setup_of(about.proposal.rings, scene.sensor, scene.ring_radius), plans
        )

    @property
    def ports(self) -> list[Port]:
        """Where the rings were."""
        return [Port(p.name, p.count, p.decoder, p.baud, p.patience) for p in self.about.ports]

    @property
    def injected(self) -> Injected | None:
        """What was done to a simulated rig."""
        return injected(self.scene, self.setup, self.about.seed) if self.about.injected else None
