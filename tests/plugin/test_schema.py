# SPDX-License-Identifier: BSD-3-Clause
"""The schema that C++ serializes is the one that Python shows."""

from pathlib import Path

import pytest
import yaml

from dual_proxy import _core
from dual_proxy.scenario import Scenario, load_scenario

SERIALIZED = [
    item for item in vars(_core).values() if hasattr(item, "_serialized_names")
]
ONE_OF_EVERYTHING = Path(__file__).parents[1] / "data" / "one_of_everything.yaml"

# What has only one value, and what the presets and the default agree on.
CONSTANT = {"robot", "angular_filter.likelihood"}


def leaves(mapping, prefix=""):
    for key, value in mapping.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def expected_names(params):
    if params is _core.Scenario:
        return [name for name in params.fields if name != "name"] + ["overrides"]
    return [field.name for field in params.__fields__]


@pytest.mark.parametrize("params", SERIALIZED, ids=lambda params: params.__name__)
def test_serialized_names_are_the_fields_in_order(params):
    assert list(params._serialized_names) == expected_names(params)


def test_every_struct_of_a_scenario_is_serialized():
    def structs(params):
        yield type(params)
        for name in type(params).fields:
            value = getattr(params, name)
            if hasattr(type(value), "fields"):
                yield from structs(value)

    found = set(structs(_core.Scenario()))
    assert len(found) > 15
    items = {_core.BoxParams, _core.Waypoint}
    # For diagrams of one's own.
    alone = {_core.ContactHistoryParams, _core.ForceTorqueAdapterParams}
    assert found | items | alone == set(SERIALIZED)


def test_one_of_everything_differs_from_every_default():
    document = yaml.safe_load(ONE_OF_EVERYTHING.read_text())
    written = dict(leaves(document["one_of_everything"]))
    defaults = dict(leaves(Scenario()._write()))
    assert {key for key in written if not key.startswith("overrides.")} == set(defaults)
    same = {key for key, value in defaults.items() if written[key] == value}
    assert same == CONSTANT
    for items, item in (
        (written["scene.boxes"], _core.BoxParams()),
        (written["operator.waypoints"], _core.Waypoint()),
    ):
        assert items
        for name in type(item).fields:
            value = getattr(item, name)
            assert items[-1][name] != getattr(value, "tolist", lambda v=value: v)()


def test_one_of_everything_is_loaded_as_written():
    document = yaml.safe_load(ONE_OF_EVERYTHING.read_text())
    dut = load_scenario(ONE_OF_EVERYTHING)
    # The recording is beside the file, wherever that is read from.
    written = document["one_of_everything"]
    recording = ONE_OF_EVERYTHING.parent / written["operator"]["recording"]
    written["operator"]["recording"] = str(recording)
    assert dut.to_mapping() == written
