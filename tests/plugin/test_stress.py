# SPDX-License-Identifier: BSD-3-Clause
"""`dual-proxy stress`: cases, what is watched of them, and how they are judged."""

import json
import shlex

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.cli import main
from dual_proxy.run import change_scenario
from dual_proxy.stress import cases, maps
from dual_proxy.stress.command import Bench, Plan, repeat_command, stress
from dual_proxy.stress.verdict import judge
from dual_proxy.watch import watch

BASES = {name: cases.base_scenario(name) for name in cases.SCENES}


def a_bench():
    return Bench(None, 2, lambda _: None)


def test_a_case_is_its_number():
    for number in range(30):
        case = cases.draw_case(number, BASES)
        assert case == cases.draw_case(number, BASES)
        assert case.number == number
    drawn = [cases.draw_case(number, BASES) for number in range(300)]
    assert {case.scheme for case in drawn} == set(dp.Scenario.SCHEMES)
    assert {case.scene for case in drawn} == set(cases.SCENES)
    assert {name for case in drawn for name in case.factors} == set(cases.FACTORS)


def test_the_hand_rests_at_the_end():
    for number in range(40):
        case = cases.draw_case(number, BASES)
        try:
            scenario = cases.case_scenario(case, BASES[case.scene])
        except dp.ScenarioError:
            continue
        points = scenario.operator.waypoints
        assert np.array_equal(points[-1].position, points[-2].position)
        rest = cases.REST + cases.REST_DELAYS * scenario.link.delay
        assert points[-1].time - points[-2].time == pytest.approx(rest)
        assert scenario.run_duration() >= points[-1].time


def test_what_is_watched_is_what_a_log_says():
    scenario = change_scenario("plane", overrides={"duration": 6.0})
    watched = watch(scenario, 1.0)
    run = dp.run(scenario, engine="bare")
    force = run.log[["device_force_x", "device_force_y", "device_force_z"]]
    most = np.linalg.norm(force.to_numpy(), axis=1).max()
    assert watched["device_force"]["value"] == pytest.approx(most, rel=1e-12)
    observed = run.log["observed_energy"].min()
    assert watched["force_loop_energy"]["value"] == pytest.approx(-observed)
    # The same from the log, in one piece.
    from dual_proxy.metrics import watch_log

    for name, _, value, *_ in watch_log(run.log, scenario, 6.0, 1.0):
        assert watched[name]["value"] == pytest.approx(value, abs=1e-9), name


def test_a_good_run_has_a_good_verdict():
    for scene in ("plane", "sim_surfaces"):
        scenario = dp.load_scenario(scene)
        assert judge(watch(scenario, 1.0), scenario) == ([], [])


def test_what_is_not_stable_is_not():
    scenario = change_scenario(
        "plane", scheme="position_force", overrides=maps._press() | {"link.delay": 0.15}
    )
    verdict = judge(watch(scenario, 2.0), scenario)
    assert any("rest_device_force" in text for text in verdict.stability)


@pytest.mark.parametrize("kind", ["nan", "infinite", "huge", "denormal", "frozen"])
@pytest.mark.parametrize(
    "name",
    [
        *("robot_position", "robot_velocity", "sensor", "device_pose"),
        *("device_velocity", "message_to_robot", "message_to_device"),
    ],
)
def test_no_bad_input_reaches_an_actuator(name, kind):
    """In free motion and in contact; afterwards all is as it was."""
    faults = [
        {"input": name, "kind": kind, "start": start, "end": start + 0.04}
        for start in (1.0, 8.0)
    ]
    scenario = change_scenario("plane", overrides={"faults": faults})
    verdict = judge(watch(scenario, 1.0), scenario)
    assert verdict == ([], [])


def test_torques_seldom_reach_their_rate(tmp_path):
    """What the proxy's jerk is limited for: its acceleration steps no more."""
    counts = {}
    for jerk in (0.0, 100.0):
        run = dp.run(
            "plane",
            engine="bare",
            overrides={"robot_proxy.limiter.max_jerk": jerk, "link.jitter": 0.02},
        )
        counts[jerk] = run.log["torque_rate_limited"].iloc[-1]
    assert counts[100.0] < 20 < counts[0.0]


def test_cases_shrink_to_what_they_need():
    bench = a_bench()
    case = cases.Case(
        0,
        "plane",
        "position_force",
        0,
        {
            "friction": {"scene.friction": 0.1},
            "delay": {"link.delay": 0.3} | maps._press(0.3),
        },
    )
    (before,) = bench.run([case])
    assert not before.stable
    assert before.safe
    (after,) = bench.shrink([before])
    assert set(after.case.factors) < set(case.factors)


def test_a_case_is_repeated_by_its_command():
    bench = a_bench()
    case = next(
        case
        for case in map(bench.draw, range(100))
        if case.factors and case.scene == "plane" and "sensor" in case.factors
    )
    words = shlex.split(repeat_command(case, bench.scenario(case)))
    assert words[:5] == ["dual-proxy", "run", "plane", "--engine", "bare"]
    overrides = dict(word.split("=", 1) for word in words[6::2])
    assert {
        key: json.loads(value) for key, value in overrides.items() if "sensor" in key
    } == {key: value for key, value in case.factors["sensor"].items()}


def test_stress_goes_on_where_it_was(tmp_path, capsys):
    plan = Plan(cases=12, drake_every=0, map_steps=0, hours=0.01)
    lines = []
    tables, _ = stress(plan, 0, tmp_path, 2, progress=lines.append)
    assert tables["regions"].startswith("| factor |")
    again = []
    assert stress(plan, 0, tmp_path, 2, progress=again.append)[0] == tables
    assert "there already" in again[0]
    assert not [line for line in again if "/" in line.split()[0]]
    record = json.loads((tmp_path / "stress.json").read_text())
    assert len(record["cases"]) == 12


def test_a_cluster_does_the_same_and_loses_nothing_when_a_worker_dies(tmp_path):
    distributed = pytest.importorskip("distributed", reason="extra `cluster`")
    plan = Plan(cases=20, drake_every=0, map_steps=0, hours=0.01)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    ) as cluster:
        killed = []

        def kill_one(_):
            if not killed:
                killed.append(next(iter(cluster.workers.values())))
                killed[0].process.process.kill()

        tables, _ = stress(
            plan,
            0,
            tmp_path / "cluster",
            progress=kill_one,
            cluster=cluster.scheduler_address,
        )
    assert killed
    assert tables == stress(plan, 0, tmp_path / "here", 2, progress=print)[0]


def test_a_cluster_that_is_not_there_is_said(tmp_path, capsys):
    arguments = ["--quick", "--cluster", "nowhere", "--out", str(tmp_path)]
    assert main(["stress", *arguments]) == 2
    assert "cluster" in capsys.readouterr().err


def test_boundaries_are_between_what_is_and_is_not_stable(tmp_path):
    found = maps.find_boundaries(
        schemes=["dual_proxy", "position_force"],
        axes=["delay"],
        steps=3,
        workers=2,
        progress=lambda _: None,
    )
    by_key = {(b.scheme, b.value): b for b in found}
    assert by_key["dual_proxy", 1.0].stiffness >= 1e5
    assert by_key["position_force", 1.0].stiffness < 3e4
    assert by_key["position_force", 1.0].why
    maps.draw_maps(found, tmp_path / "maps.png")
    assert (tmp_path / "maps.png").stat().st_size > 1e4


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--cases", "0"], "cases: expected at least 1, got 0"),
        (["--first", "-1"], "first: expected at least 0, got -1"),
        (["--case", "-1"], "case: expected at least 0, got -1"),
        (["--jobs", "0"], "jobs: expected at least 1, got 0"),
        (["--quick", "--page", "x.md"], "--page: expected the whole benchmark"),
    ],
)
def test_bad_arguments_are_one_line(arguments, problem, tmp_path, capsys):
    assert main(["stress", "--out", str(tmp_path), *arguments]) == 2
    error = capsys.readouterr().err
    assert problem in error
    assert error.count("\n") == 1


def test_one_case_is_explained(capsys):
    assert main(["stress", "--case", "3"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("case 3: ")
    assert "dual-proxy run" in text
