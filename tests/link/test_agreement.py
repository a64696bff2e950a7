# SPDX-License-Identifier: BSD-3-Clause
"""What sides tell each other of what they are made of."""

import json

import pytest

import dual_proxy as dp
from dual_proxy.link.agreement import Agreement, describe_side


def made_of(**overrides):
    overrides = {key.replace("__", "."): value for key, value in overrides.items()}
    return describe_side(dp.load_scenario("plane").with_overrides(overrides))


def told(mine, theirs):
    """What the one makes of what the other tells."""
    agreement = Agreement(1, mine)
    agreement.take(Agreement(2, theirs).tell(0.0, 0), 0)
    assert agreement.malformed == 0
    return agreement.difference(2)


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        ({}, ""),
        ({"link__delay": 0.1}, ""),
        ({"scheme": "tdpa"}, "scheme tdpa, this one dual_proxy"),
        ({"map__scale": 2.0}, "map.scale 2, this one 2.5"),
        (
            {"map__R_DB": [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]},
            "map.R_DB [0, 1, 0, -1, 0, 0, 0, 0, 1], "
            "this one [1, 0, 0, 0, 1, 0, 0, 0, 1]",
        ),
        (
            {"map__R_cw": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]},
            "map.R_cw [1, 0, 0, 0, 1, 0, 0, 0, 1], "
            "this one [1, 0, 0, 0, -1, 0, 0, 0, -1]",
        ),
        (
            {"scene__start_position": [0.45, 0, 0.5]},
            "scene.start_position [0.45, 0, 0.5], this one [0.45, 0, 0.48]",
        ),
        ({"control_period": 0.002}, "control_period 0.002, this one 0.001"),
        ({"link__rate": 20}, "link.rate 20, this one 50"),
    ],
)
def test_what_differs_is_named_with_both_values(overrides, said):
    assert told(made_of(), made_of(**overrides)) == said


def test_the_largest_is_taken():
    third = 1 / 3
    R = [[2 * third, -third, 2 * third]] * 3
    widest = {**made_of(), "map.R_DB": [*R[0], *R[1], *R[2]]}
    assert told(widest, widest) == ""
    # The last bits of another machine.
    assert told({"map.scale": 2.5}, {"map.scale": 2.5 + 1e-12}) == ""


def test_another_versions_fields_are_named():
    assert told({"a": 1.0, "b": 2.0}, {"a": 1.0}) == "no b, this one 2"
    assert told({"a": 1.0}, {"a": 1.0, "b": 2.0}) == "b 2, this one none"
    assert told({"a": [1.0]}, {"a": 1.0}) == "a 1, this one [1]"


def message(**fields):
    return json.dumps({"session": 2, "made_of": {}, **fields}).encode()


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff",
        b"[" * 2000,
        b"[]",
        b"{}",
        message() + b" " * 2048,
        message(more=1),
        message(session=0),
        message(session=-1),
        message(session=2**64),
        message(session=True),
        message(session="2"),
        message(made_of=[]),
        message(made_of={str(i): 1 for i in range(17)}),
        message(made_of={"scheme": "x" * 41}),
        message(made_of={"scheme": "a\nb"}),
        message(made_of={"sch\x1beme": "a"}),
        message(made_of={"map.scale": float("nan")}),
        message(made_of={"map.scale": float("inf")}),
        message(made_of={"map.scale": 10**400}),
        message(made_of={"map.scale": True}),
        message(made_of={"map.scale": None}),
        message(made_of={"map.R_DB": [1] * 10}),
        message(made_of={"map.R_DB": [[1]]}),
    ],
)
def test_what_is_malformed_is_ignored_and_counted(data):
    agreement = Agreement(1, made_of())
    agreement.take(data, 0)
    assert agreement.malformed == 1
    assert agreement.difference(2) is None


def test_the_first_stands_and_of_many_the_one_that_is_heard_is_kept():
    mine = made_of()
    agreement = Agreement(1, mine)
    agreement.take(message(session=7, made_of=mine), 7)
    agreement.take(message(session=7, made_of={}), 7)
    for session in range(100, 200):
        agreement.take(message(session=session), 7)
    assert agreement.difference(7) == ""
    known = [s for s in range(100, 200) if agreement.difference(s) is not None]
    assert known == list(range(193, 200))


def test_it_is_told_to_a_new_peer_at_once_and_once_a_second():
    agreement = Agreement(1, made_of())
    times = [0.0, 0.5, 0.6, 0.7, 1.5, 1.65, 2.0]
    peers = [0, 0, 5, 5, 5, 5, 6]
    told = [agreement.tell(*at) is not None for at in zip(times, peers, strict=True)]
    assert told == [True, False, True, False, False, True, True]
