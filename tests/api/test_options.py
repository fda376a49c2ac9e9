"""Options are defined once: Python, the command and the checks have the fields of one class."""

import inspect
from dataclasses import fields

import place_rings as pr
import pytest
from place_rings.cli.app import app
from place_rings.cli.options.common import option_of
from place_rings.objectives.options import ReportOptions, RobustnessOptions, VerifyOptions
from place_rings.placement.search.options import ImproveOptions, SearchOptions
from place_rings.simulation.safety_options import SafetyOptions

CLASSES = {
    "search": SearchOptions,
    "improve": ImproveOptions,
    "verify": VerifyOptions,
    "report": ReportOptions,
    "robustness": RobustnessOptions,
    "safety": SafetyOptions,
}


@pytest.mark.parametrize("name", CLASSES)
def test_python_and_the_command_have_all_fields_with_their_defaults_and_words(name):
    function, command = getattr(pr, name), app if name == "search" else app[name]
    parameters = inspect.signature(function).parameters
    offered = {a.name: a for a in command.assemble_argument_collection()}
    for field in fields(CLASSES[name]):
        assert parameters[field.name].default == field.default
        assert f"    {field.name}: " in function.__doc__
        if field.name != "start":
            assert offered[option_of(field.name)].parameter.help


WRONG = [
    ({"rings": 3, "rings_per_link": 2}, "rings: found 3 .*rings_per_link 2"),
    ({"fewest_rings": True}, "fewest_rings: .*sensors"),
    ({"fewest_rings": True, "sensors": 9, "rings": 2}, "fewest_rings: .*rings 2"),
    ({"fewest_rings": True, "reach": 9.0}, "fewest_rings: .*reach 9"),
    ({"within": 1.0}, "within: found 1.*sensors"),
    ({"within": 1.0, "sensors": 9, "any_rings": True}, "within: .*any_rings"),
    ({"any_rings": True}, "any_rings: .*sensors"),
    ({"any_rings": True, "sensors": 9, "rings": 2}, "any_rings: .*rings 2"),
    ({"any_rings": True, "sensors": 9, "fewest_rings": True}, "fewest_rings: .*any_rings"),
    ({"within": -1.0, "fewest_rings": True, "sensors": 9}, "within: found -1"),
    ({"within": 100.0, "sensors": 9}, "within: found 100"),
    ({"rings": 0}, "rings: found 0"),
    ({"searches": 2, "reach": 50}, "searches: found 2.*any_rings"),
    ({"searches": 2, "sensors": 20}, "searches: found 2.*any_rings"),
    ({"searches": 0}, "searches: found 0"),
    ({"reach": 100.0}, "reach: found 100"),
    ({"reach": float("nan")}, "reach: found nan"),
    ({"sensors": True}, "sensors: found True.*integer"),
    ({"time": float("inf")}, "time: found inf"),
    ({"device": "tpu"}, "device: found 'tpu'.*gpu"),
    ({"tolerant": True, "losing": "ring"}, "losing: .*tolerant"),
    ({"position_error_mm": 3.0}, "position_error_mm: .*tolerant"),
]


@pytest.mark.parametrize(("given", "says"), WRONG)
def test_options_that_are_out_of_range_or_contradict_each_other_are_refused(given, says):
    with pytest.raises(pr.InputError, match=says):
        pr.search(**given)
