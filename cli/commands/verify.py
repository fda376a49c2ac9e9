"""The command verify."""

from ...objectives.options import VerifyOptions
from ..options.common import Json, Subject
from ..options.groups import AS_IT_IS, SubjectOptions
from ..options.offered import offering


@offering()
def verify(
    subject: Subject,
    /,
    *,
    given: SubjectOptions = AS_IT_IS,
    options: VerifyOptions,
    as_json: Json = False,
) -> None:
    """Count the coverage of a setup with its error, or compute an interval guaranteed to hold it.

    For example:

    ```bash
    place-rings verify n2_16_25 --target V_S --radius 0.5
    place-rings verify n2_16_25 --target V_S:0.5 --rule certified --width 1
    place-rings verify n3_16_55 --sensor vl53l1x --ambient 50kcps
    ```

    ``place-rings --help`` explains the terms.
    """
    from ..runs.verify import verify as run

    run(given.resolved(subject), options, as_json)
