# SPDX-License-Identifier: BSD-3-Clause
"""Whatever stands in a scenario's file or in overrides: a scenario that is the
same after it was written and read, or one line that says what is wrong."""

import copy
import re
import tempfile
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from strategies import DATA, TEXTS, leaves, require_line

import dual_proxy as dp
from dual_proxy.scenario import Scenario, ScenarioError, list_scenarios, load_scenario
from dual_proxy.settings import parse_yaml

FOLDER = Path(tempfile.mkdtemp(prefix="dual-proxy-fuzz-"))
MINIMAL = {
    "operator": {
        "waypoints": [
            {"time": 0, "position": [0.45, 0, 0.18]},
            {"time": 1, "position": [0.45, 0, 0.15]},
        ]
    }
}
PLANE = load_scenario("plane")
KEYS = sorted({key for key, _ in leaves(PLANE.to_mapping())} | {"scheme", "law"})


def bomb(levels: int) -> str:
    """10 ** levels strings by aliases."""
    text = "&a0 [" + ", ".join(10 * ["x"]) + "]"
    for i in range(1, levels):
        text = f"&a{i} [{text}" + 9 * f", *a{i - 1}" + "]"
    return text


# Pieces of YAML that no dump would write.
RAW = [
    *("[" * 600, "{a: " * 600, "&b [*b]", "&c {x: *c}", bomb(4), bomb(9)),
    *("!!int abc", "!!int ''", "!!float x", "!!bool x", "!!null x", "!!timestamp x"),
    *("2024-99-99", "2024-01-01", "!!binary '%'", "!!binary aGk=", "!!set {a}"),
    *(
        "!!omap [a: 1]",
        "!!pairs [a: 1]",
        "!!python/name:os.system",
        "!mine {}",
        "!!str [1]",
    ),
    *(
        "9" * 5000,
        "-" + "9" * 310,
        "1e400",
        "0x1F",
        "0o17",
        "0b1",
        "190:20:30",
        "1_000",
    ),
    *(
        ".inf",
        "-.INF",
        ".nan",
        "1e-320",
        "~",
        "=",
        "<<",
        "*none",
        "? a",
        "|\n  a",
        "- -",
    ),
    *(
        '"\\ud800"',
        '"\\0"',
        '"\\x85"',
        '"a\\L b"',
        '"\\q"',
        "'",
        "\t",
        "\ufeff",
        "%",
        "@",
        "`",
        "# ",
    ),
    *("{<<: {a: 1}}", "{a: 1, a: 2}", "{1: 2}", "{[1]: 2}", "{~: 2}", "--- a", "... "),
]


def paths(tree: object, path: tuple = ()) -> list[tuple]:
    """Where something stands in plain data."""
    found = [path]
    if isinstance(tree, dict):
        for key, value in tree.items():
            found += paths(value, (*path, key))
    elif isinstance(tree, list):
        for index, value in enumerate(tree):
            found += paths(value, (*path, index))
    return found


@st.composite
def documents(draw: st.DrawFn) -> str:
    """A shipped or a small scenario in which something was changed."""
    name = draw(st.sampled_from(["", *list_scenarios()]))
    tree = {"tiny": copy.deepcopy(MINIMAL)}
    if name:
        folder = Path(dp.__file__).parent / "scenarios"
        tree = yaml.safe_load((folder / f"{name}.yaml").read_text())
    raw = []
    for _ in range(draw(st.integers(0, 3))):
        if len(places := paths(tree)[1:]) == 0:
            break
        *parents, last = draw(st.sampled_from(places))
        holder = tree
        for key in parents:
            holder = holder[key]
        what = draw(
            st.sampled_from(["data", "raw", "delete", "rename", "wrap", "copy"])
        )
        if what == "delete":
            del holder[last]
        elif what == "rename" and isinstance(holder, dict):
            holder[draw(TEXTS)] = holder.pop(last)
        elif what == "wrap":
            holder[last] = [holder[last]]
        elif what == "copy":
            holder[last] = copy.deepcopy(
                draw(st.sampled_from(list(tree.values()) or [0]))
            )
        elif what == "data":
            holder[last] = draw(DATA)
        else:
            raw.append(draw(st.sampled_from(RAW)))
            holder[last] = f"RAW{len(raw) - 1}RAW"
    try:
        text = yaml.safe_dump(tree, allow_unicode=True, sort_keys=False)
    except ValueError:  # A number of too many digits.
        return "tiny: 0"
    text = re.sub(r"RAW(\d+)RAW", lambda match: raw[int(match[1])], text)
    if draw(st.integers(0, 4)) == 0:
        place = draw(st.integers(0, len(text)))
        text = text[:place] + draw(TEXTS) + text[place + draw(st.integers(0, 9)) :]
    return text


def check(scenario: Scenario) -> None:
    text = scenario.to_yaml()
    path = FOLDER / "again.yaml"
    path.write_text(text, encoding="utf-8")
    twin = load_scenario(path)
    assert twin == scenario
    assert twin.to_yaml() == text
    try:
        assert 0 < scenario.run_duration() < 2e5
    except ScenarioError as error:  # Its recording is read only now.
        require_line(error)
        if not scenario.operator.recording:
            raise


def check_file(content: bytes) -> None:
    path = FOLDER / "x.yaml"
    path.write_bytes(content)
    try:
        scenario = load_scenario(path)
    except ScenarioError as error:
        require_line(error, r".: .+")
        return
    check(scenario)


@given(documents())
def test_a_changed_file(text):
    check_file(text.encode("utf-8", "surrogatepass"))


@given(st.binary(max_size=200) | st.sampled_from([b"\xff\xfe", b"\xef\xbb\xbfa: b"]))
def test_any_bytes(content):
    check_file(content)


@pytest.mark.parametrize("raw", RAW, ids=lambda raw: ascii(raw[:12]))
@pytest.mark.parametrize(
    "form",
    [
        "{0}",
        "{0}: {{}}",
        "tiny: {0}",
        "tiny: {{duration: {0}}}",
        "tiny: {{description: {0}}}",
        "tiny: {{{0}: 1}}",
        "tiny: {{map: {{p_cw: {0}}}}}",
        "tiny: {{scene: {{start_position: [0, {0}, 0]}}}}",
        "tiny: {{operator: {{waypoints: [{0}]}}}}",
    ],
)
def test_every_odd_piece_everywhere(raw, form):
    check_file(form.format(raw).encode("utf-8", "surrogatepass"))


def set_one(key, value):
    try:
        dut = PLANE.with_overrides({key: value})
    except ScenarioError as error:
        require_line(error, "^plane")
        return
    check(dut)


@given(st.sampled_from(KEYS), DATA)
def test_any_value_of_any_key(key, value):
    set_one(key, value)


@given(st.sampled_from(KEYS), st.floats(0.3, 3) | st.floats(-1e3, 1e3))
def test_any_number_of_any_key(key, factor):
    value = dict(leaves(PLANE.to_mapping())).get(key)
    set_one(key, value * factor if isinstance(value, float) else factor)


@given(TEXTS, DATA)
def test_any_key(key, value):
    set_one(key, value)


@given(st.sampled_from(KEYS), st.sampled_from(RAW) | TEXTS)
def test_any_text_for_a_key(key, text):
    try:
        value = parse_yaml(text, "--set")
    except ScenarioError as error:
        require_line(error)
        return
    set_one(key, value)


def test_a_mapping_that_contains_itself():
    loop: dict = {}
    loop["x"] = loop
    with pytest.raises(ScenarioError, match=r"map\.p_cw\.x\..*is taken from"):
        Scenario.from_mapping("tiny", {"map": {"p_cw": loop}})
