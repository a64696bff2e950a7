# SPDX-License-Identifier: BSD-3-Clause
"""The schema that C++ serializes is the one that Python shows."""

from pathlib import Path

import yaml

from dual_proxy import _core
from dual_proxy.scenario import Scenario, load_scenario

ONE_OF_EVERYTHING = Path(__file__).parents[1] / "data" / "one_of_everything.yaml"

# What has only one value, and what the presets and the default agree on.
CONSTANT = {"robot", "angular_filter.likelihood"}


def leaves(mapping, prefix=""):
    for key, value in mapping.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def test_one_of_everything_differs_from_every_default():
    document = yaml.safe_load(ONE_OF_EVERYTHING.read_text())
    written = dict(leaves(document["one_of_everything"]))
    defaults = dict(leaves(Scenario()._write()))
    assert {key for key in written if not key.startswith("overrides.")} == set(defaults)
    same = {key for key, value in defaults.items() if written[key] == value}
    assert same == CONSTANT
    for items, item in (
        (written["scene.surfaces"], _core.SurfaceParams()),
        (written["operator.waypoints"], _core.Waypoint()),
        (written["claims"], _core.Claim()),
    ):
        for name in type(item).fields:
            value = getattr(item, name)
            usual = getattr(value, "tolist", lambda v=value: v)()
            assert any(item[name] != usual for item in items if name in item), name


def test_one_of_everything_is_loaded_as_written():
    document = yaml.safe_load(ONE_OF_EVERYTHING.read_text())
    dut = load_scenario(ONE_OF_EVERYTHING)
    # Further files are beside the file, wherever that is read from.
    written = document["one_of_everything"]
    for section, key in (("operator", "recording"), ("scene", "model_directives")):
        path = ONE_OF_EVERYTHING.parent / written[section][key]
        written[section][key] = str(path)
    assert dut.to_mapping() == written
