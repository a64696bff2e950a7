# SPDX-License-Identifier: BSD-3-Clause
"""What is claimed of a scene beside what was measured."""

import json

import pytest

import dual_proxy as dp
from dual_proxy.claims import claims_json, judge, limit_text, statement

ERROR = "normal_error_mean_deg"


def make_scenario(claims, **overrides):
    scenario = dp.load_scenario("plane").with_overrides(overrides)
    scenario.claims = [dp.Claim(**claim) for claim in claims]
    scenario.validate()
    return scenario


@pytest.mark.parametrize(
    ("bounds", "value", "met"),
    [
        ({"at_most": 5.0}, 5.0, True),
        ({"at_most": 5.0}, 5.1, False),
        ({"at_least": 5.0}, 5.0, True),
        ({"at_least": 5.0}, 4.9, False),
        ({"at_least": 4.0, "at_most": 5.0}, 4.5, True),
        ({"at_least": 4.0, "at_most": 5.0}, 3.9, False),
        ({"at_most": 5.0}, None, None),
    ],
)
def test_a_claim_is_a_range(bounds, value, met):
    scenario = make_scenario([{"metric": ERROR, **bounds}])
    ((claim, found, verdict),) = judge(scenario, {ERROR: value})
    assert claim.metric == ERROR
    assert (found, verdict) == (value, met)


@pytest.mark.parametrize(
    ("claim", "overrides", "about"),
    [
        ({}, {}, True),
        ({}, {"scheme": "position_force"}, False),
        ({"scheme": "position_force"}, {"scheme": "position_force"}, True),
        ({"scheme": "position_force"}, {}, False),
        ({"min_delay": 0.05}, {"link.delay": 0.05}, True),
        ({"min_delay": 0.05}, {"link.delay": 0.04}, False),
        ({"max_delay": 0.15}, {"link.delay": 0.15}, True),
        ({"max_delay": 0.15}, {"link.delay": 0.2}, False),
        ({"max_friction": 0.0}, {}, False),
        ({"max_friction": 0.0}, {"scene.friction": 0.0}, True),
    ],
)
def test_claims_are_about_some_runs(claim, overrides, about):
    claims = [{"metric": ERROR, "at_most": 5.0, **claim}]
    assert len(judge(make_scenario(claims, **overrides), {ERROR: 1.0})) == about


def test_texts():
    claim = dp.Claim(
        metric="position_rms_free_m",
        at_most=0.01,
        paper="errors stay below 10 mm",
        source="VI.A",
    )
    assert statement(claim) == "errors stay below 10 mm (VI.A)"
    assert limit_text(claim) == "position_rms_free_m <= 0.01 m"
    aim = dp.Claim(metric="dimension_accuracy", at_least=0.9, at_most=1.0)
    assert statement(aim) == "aim of this project"
    assert limit_text(aim) == "dimension_accuracy >= 0.9 and <= 1"


@pytest.mark.parametrize("metric", ["limits_broken", "finite", "sensor_ready", "charm"])
def test_what_is_no_number_cannot_be_claimed(metric):
    with pytest.raises(
        dp.ScenarioError,
        match=r"claims\[0\].metric: expected a number among the keys of metrics.json, "
        f'got "{metric}"',
    ):
        dp.load_scenario("plane").with_overrides(
            {"claims": [{"metric": metric, "at_most": 1}]}
        )


def test_a_statement_is_one_line():
    claim = dp.Claim(metric=ERROR, at_most=5.0, paper="it is\n  small\n", source="VI")
    assert statement(claim) == "it is small (VI)"


def test_json_has_claim_limit_value_and_verdict():
    scenario = make_scenario(
        [
            {"metric": ERROR, "at_most": 5.0, "paper": "small", "source": "VI"},
            {"metric": "contact_losses", "at_least": 1.0},
        ]
    )
    rows = json.loads(claims_json(judge(scenario, {ERROR: 6.0})))
    assert rows == [
        {
            "claim": "small (VI)",
            "metric": ERROR,
            "at_least": None,
            "at_most": 5.0,
            "value": 6.0,
            "met": False,
        },
        {
            "claim": "aim of this project",
            "metric": "contact_losses",
            "at_least": 1.0,
            "at_most": None,
            "value": None,
            "met": None,
        },
    ]


def test_claims_decide_nothing():
    """They are no part of what is run, and go along with what is saved."""
    scenario = dp.load_scenario("sim_cylinder")
    assert scenario.claims
    again = dp.Scenario.from_mapping(scenario.name, scenario.to_mapping())
    assert again == scenario
    with pytest.raises(
        dp.ScenarioError, match=r"claims\[0\].metric: expected a number"
    ):
        scenario.with_overrides({"claims": [{"metric": "charm", "at_most": 1}]})
    assert scenario.with_overrides({"claims": []}).claims == ()


@pytest.mark.parametrize(
    "scene",
    [
        *("plane", "sim_cylinder", "sim_cylinder_wall", "sim_surfaces"),
        *("inner_corner", "outer_corner", "remote_ultrasound", "flat_tool", "shared"),
    ],
)
def test_scenes_of_the_paper_say_what_it_claims(scene):
    claims = dp.load_scenario(scene).claims
    of_paper = [claim for claim in claims if claim.paper]
    assert of_paper
    assert all(claim.source for claim in of_paper)
