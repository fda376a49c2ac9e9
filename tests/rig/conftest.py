"""A whole check of a simulated rig, recorded once for all tests."""

import pytest


@pytest.fixture(scope="session")
def stops():
    """Stops of a mount check."""
    from . import taped  # not before: the core's tests run where this cannot be imported

    return taped.stops()


@pytest.fixture(scope="session")
def taped(tmp_path_factory, stops):
    """A recorded check."""
    from . import taped

    return taped.recorded(tmp_path_factory.mktemp("taped"), stops)


@pytest.fixture(scope="session")
def plans():
    """Plans of a check that moves the robot: all stops are reachable."""
    from . import taped

    return taped.plans()
