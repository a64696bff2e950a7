# SPDX-License-Identifier: BSD-3-Clause
"""Each layer of the C++ code includes only those in front of it."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# From the ground up; see docs/architecture.md.
LAYERS = {
    "common": "systems",
    "link": "systems",
    "proxy": "systems",
    "perception": "systems",
    "control": "systems",
    "schemes": "systems",
    "sides": "systems",
    "simulation": "systems",
    "loop": "systems",
    "faces": "systems",
    "robots": "plugin",
    "drivers": "plugin",
    "experiment": "plugin",
    "station": "plugin",
}
INCLUDE = re.compile(r'^#include "dual_proxy/(\w+)/', re.MULTILINE)


def sources(layer):
    folder = ROOT / LAYERS[layer] / layer
    return [p for p in sorted(folder.rglob("*")) if p.suffix in (".h", ".cc")]


@pytest.mark.parametrize("layer", LAYERS)
def test_includes_point_down(layer):
    order = list(LAYERS)
    below = order[: order.index(layer) + 1]
    assert not [
        (f"{layer}/{path.name}", included)
        for path in sources(layer)
        for included in INCLUDE.findall(path.read_text("utf-8"))
        if included not in below
    ]


def test_no_scheme_knows_another():
    schemes = ROOT / "systems" / "schemes"
    for path in schemes.glob("*/*"):
        others = re.findall(r'"dual_proxy/schemes/(\w+)/', path.read_text("utf-8"))
        assert set(others) <= {path.parent.name}, path


def test_every_folder_is_a_layer():
    folders = {p.parent.name for p in ROOT.glob("systems/*/CMakeLists.txt")}
    assert folders == {name for name, root in LAYERS.items() if root == "systems"}


def test_only_faces_and_station_include_drake():
    """And so all else compiles without it."""
    for layer in LAYERS:
        if layer in ("faces", "station"):
            continue
        for path in sources(layer):
            assert "#include <drake/" not in path.read_text("utf-8"), path


def test_what_is_logged_is_made_without_the_c_librarys_functions():
    """Their last bits depend on the processor; see common/elementary.h."""
    names = "a?sinh?|a?cosh?|a?tanh?|atan2|exp2?|expm1|log|log2|log10|log1p|pow"
    call = re.compile(rf"std::({names}|hypot|cbrt)\(")
    for layer in LAYERS:
        if LAYERS[layer] != "systems":
            continue
        for path in sources(layer):
            assert not call.findall(path.read_text("utf-8")), path
