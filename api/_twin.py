"""Twin of a setup in MuJoCo."""

from dataclasses import dataclass

from ._errors import input_errors
from ._options import called_with
from ._validation import SetupCall, resolve_setup
from .simulation.twin.building import TwinOptions, sensor_twin
from .simulation.twin.sensor_twin import SensorTwin


@dataclass(frozen=True)
class TwinCall(TwinOptions, SetupCall):
    """A call of ``twin``."""


@called_with(TwinCall)
def twin(call: TwinCall) -> SensorTwin:
    """Build a twin of a setup in MuJoCo, whose sensors report what they would on the real robot.

    It needs the extra ``mujoco``: ``pip install 'place-rings[mujoco]'``.

    Returns:
        The twin, at time 0.

    Raises:
        InputError: for a setup that does not fit the scene, a model with another arm, or a value
            out of range.

    Example:
        >>> import place_rings as pr
        >>> twin = pr.twin("n1_8_0", pr.Scene(sensor={"model": "vl53l5cx"}), seed=1)
        >>> frame = twin.step(twin.q)
        >>> frame.distance_mm.shape, frame.targets_mm.shape
        ((24, 64), (24, 64, 4))
    """
    name, placed, core = resolve_setup(call.setup, call.scene)
    with input_errors():
        return sensor_twin(name, placed, core, call)
