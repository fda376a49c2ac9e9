"""What is refused names every argument as its caller writes it, and is refused before any work."""

import copy

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings._errors import InputError
from place_rings.cli.options.common import option_of

NAMES = ("rings", "any_rings", "rings_per_link", "sensors", "sensors_per_ring", "reach")


@given(st.lists(st.sampled_from(NAMES), min_size=1, unique=True))
def test_a_name_that_occurs_in_the_option_of_another_is_written_once(names):
    error = InputError(" and ".join(names), "within", others=tuple(names))
    options = " and ".join("--" + name.replace("_", "-") for name in names)
    assert error.written(option_of) == f"--within: {options}"


@pytest.mark.parametrize("wanted", [{"reach": 90}, {"sensors": 12}, {"sensors": 12, "rings": 2}])
def test_electronics_that_carry_no_ring_are_refused_before_a_search_begins(wanted):
    scene = pr.Scene("ur5e", sensor=pr.sensors["vl53l5cx"], targets=pr.Near(0.3))
    steps = []
    with pytest.raises(pr.InfeasibleError):
        pr.search(scene, **wanted, time=0.2, voxel=0.05, progress=steps.append)
    assert not steps


@settings(max_examples=20)
@given(st.one_of(st.integers(), st.floats(), st.text(max_size=9), st.lists(st.booleans())))
def test_a_reach_that_is_none_is_refused_under_its_own_key(found):
    if found == "person":
        return
    with pytest.raises(pr.InputError) as error:
        pr.Scene(targets=pr.Near(0.3, reachable=found))
    assert "reachable:" in str(error.value)
    assert "bool" not in str(error.value).partition("found")[0]


@given(st.one_of(st.none(), st.text(max_size=5), st.lists(st.floats()), st.floats(max_value=0)))
def test_a_near_volume_without_a_radius_is_refused(found):
    with pytest.raises(pr.InputError) as error:
        pr.Near(found)
    assert error.value.argument == "Near: radius"


@given(st.lists(st.lists(st.floats(-9, 9), max_size=4), min_size=3, max_size=5))
def test_areas_are_polygons_of_pairs(corners):
    if all(len(corner) == 2 for corner in corners):
        assert pr.Person(floor=0.0, areas=[corners]).areas == (tuple(map(tuple, corners)),)
        return
    with pytest.raises(ValueError, match=r"^Person: areas"):
        pr.Person(floor=0.0, areas=[corners])


@pytest.mark.parametrize(
    ("former", "today"), [("symbol", "kind"), ("goal", None), ("volume", None)]
)
def test_former_attributes_of_a_target_lead_to_those_of_today(former, today):
    target = pr.Shell(0.5, weight=0.3, at_least_percent=40)
    with pytest.warns(DeprecationWarning, match=former):
        value = getattr(target, former)
    assert value == (target if today is None else getattr(target, today))


def test_former_attributes_of_a_record_in_percent_lead_to_its_keys():
    record = pr.verify("n1_8_0", voxel=0.1).records[0]
    with pytest.warns(DeprecationWarning, match="zeta_percent"):
        assert record.zeta_percent == pytest.approx(100 * record.zeta)
    with pytest.raises(AttributeError, match="width_percent"):
        _ = record.width_percent
    assert copy.deepcopy(record) == record


@pytest.mark.parametrize("name", ["voxel", "width", "memory"])
def test_an_integer_beyond_all_floats_is_refused_by_its_option(name):
    with pytest.raises(InputError, match=f"^{name}: "):
        pr.verify("n1_8_0", rule="certified", **{name: 10**400})


@pytest.mark.parametrize("found", ["hand", 3, pr.Detection])
def test_what_is_no_question_of_detection_is_refused_under_its_name(found):
    scene = pr.Scene(targets=pr.Near(0.3))
    for call in (
        lambda: pr.verify("n1_4_0", scene, detect=found),
        lambda: pr.search(scene, sensors=4, time=0.2, detect=found),
        lambda: pr.safety("n1_4_0", scene, approaches=16, detect=found),
        lambda: pr.coverage_fraction("n1_4_0", scene, np.zeros((4, 3)), detect=found),
    ):
        with pytest.raises(pr.InputError) as error:
            call()
        assert error.value.argument == "detect"


@pytest.mark.parametrize(
    ("name", "value"),
    [("packages", ["folder"]), ("package", {"arm": "x"}), ("xacro_args", {"name": "ur10"})],
)
def test_a_view_without_a_urdf_refuses_how_one_is_read(name, value):
    with pytest.raises(pr.InputError) as error:
        pr.view("n1_8_0", browser=False, wait=False, **{name: value})
    assert error.value.argument == name
