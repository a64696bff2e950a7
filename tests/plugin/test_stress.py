# SPDX-License-Identifier: BSD-3-Clause
"""`dual-proxy stress`: cases, what is watched of them, and how they are judged."""

import functools
import json
import shlex

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy import many_runs
from dual_proxy.cli import main
from dual_proxy.log import signal
from dual_proxy.many_runs import Job, Result
from dual_proxy.metrics import describe_broken_limits, watch_log
from dual_proxy.run import change_scenario
from dual_proxy.scene_params import CORNER_RADIUS, TIP_RADIUS
from dual_proxy.stress import cases, command, maps
from dual_proxy.stress.command import Bench, Outcome, Plan, stress
from dual_proxy.stress.verdict import Verdict, judge, rest_time
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
    # What the feedback does, by hand: the force is that of the row before.
    sent = signal(run.log, "force_space_force")
    selection = signal(run.log, "force_selection").reshape(-1, 3, 3)
    asked = np.einsum("nij,nj->ni", selection, signal(run.log, "reference_force"))
    velocity = signal(run.log, "robot_velocity")
    power = ((sent - asked)[:-1] * (velocity[1:] + velocity[:-1]) / 2).sum(1)
    energy = np.cumsum(np.r_[0, 1e-3 * (power - 1e-3)])
    most = (energy - np.minimum.accumulate(energy)).max()
    assert most > 1e-5
    assert watched["force_loop_energy"]["value"] == pytest.approx(most)
    # The same from the log, in one piece.
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
    assert "rest" in verdict.kinds


def test_the_worst_is_the_same_from_a_watch_and_from_a_log():
    """Case 309: joint 4 is over its limit first, joint 1 is further over it."""
    bench = a_bench()
    case = bench.draw(309)
    case = functools.reduce(cases.Case.without, set(case.factors) - {"model"}, case)
    scenario = bench.scenario(case)
    run = dp.run(scenario, engine="bare")
    broken = describe_broken_limits(run.log, scenario)
    assert broken
    assert judge(watch(scenario, 2.0), scenario).safety == broken


def test_starts_in_penetration_are_real():
    seen = set()
    for number in range(1500):
        case = cases.draw_case(number, BASES)
        base = BASES[case.scene]
        if "penetration" not in case.factors or case.scene in seen:
            continue
        seen.add(case.scene)
        keys = case.factors["penetration"]
        ball = keys["scene.surfaces"][-1]
        # Of the scene's own surfaces none is lost.
        assert len(keys["scene.surfaces"]) == len(base.scene.surfaces) + 1
        scenario = base.with_overrides(keys | {"duration": 0.01, "seed": 1})
        run = dp.run(scenario, engine="bare")
        place = signal(run.log, "robot_position")[0]
        own = TIP_RADIUS
        if base.scene.tool == "flat":
            place = place + np.array(base.map.R_cw) @ base.scene.corners()[0]
            own = CORNER_RADIUS
        distance = np.linalg.norm(place - ball["position"])
        assert -4.1e-3 < distance - ball["radius"] - own < -0.9e-4
        if base.robot != "point_mass":  # It has left by the end of the first period.
            assert np.linalg.norm(signal(run.log, "contact_force")[0]) > 0.1
    assert seen == set(cases.SCENES)


def test_a_start_in_penetration_is_one_in_drake_too():
    keys = cases._penetration(np.random.default_rng(3), BASES["plane"])
    scenario = change_scenario("plane", overrides=keys | {"duration": 0.01})
    for engine in ("bare", "drake"):
        log = dp.run(scenario, engine=engine).log
        assert np.linalg.norm(signal(log, "contact_force")[1]) > 0.1, engine


def test_recovery_is_judged_against_its_limit():
    """Following the hand again: 10 s after the link is there, by the proxy's text."""
    plan = {"link.outages": [[3.0, 5.0]]}
    scenario = change_scenario("plane", overrides=plan)
    watched = watch(scenario, 1.0)
    assert 0.0 < watched["recovery_time"]["value"] < 5.0
    assert judge(watched, scenario) == ([], [])
    # A proxy that creeps is not back in time.
    slow = change_scenario(
        "plane",
        overrides=plan
        | {
            "robot_proxy.limiter.max_velocity": 2e-4,
            "robot_proxy.recovery_speed": 1e-4,
        },
    )
    assert judge(watch(slow, 1.0), slow).kinds[-1] == "recovery_time"


def test_the_energy_of_a_force_loop_that_swings_is_seen():
    scenario = change_scenario(
        "plane",
        overrides=maps._press()
        | {
            "controller.force_gain": 10.0,
            "sensor.delay": 0.016,
            "scene.contact_stiffness": 5e4,
        },
    )
    assert "force_loop_energy" in judge(watch(scenario, 2.0), scenario).kinds


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
    (before,) = bench.run([(case, "bare")])
    assert not before.stable
    assert before.safe
    (after,) = bench.shrink([before])
    assert set(after.case.factors) < set(case.factors)


def test_the_dual_proxy_passes_the_first_cases():
    bench = a_bench()
    first = [bench.draw(number) for number in range(60)]
    own = [(case, "bare") for case in first if case.scheme == "dual_proxy"]
    outcomes = bench.run(own)
    assert len(outcomes) > 25
    assert [o.command for o in outcomes if not o.stable and not o.refused] == []


def an_outcome(case, engine="bare", safety=(), stability=(), **others):
    verdict = Verdict(list(safety), list(stability))
    return Outcome(case, engine, "", "", verdict, {}, **others)


def test_cases_shrink_in_the_engine_in_which_they_failed(monkeypatch):
    """Only Drake's run fails, with both factors and with the first alone."""
    ran = []

    def run(self, pairs):
        ran.extend(pairs)
        return [
            an_outcome(
                case,
                engine,
                stability=["rest_device_force 1 N, not 0.1 or less"]
                if engine == "drake" and "delay" in case.factors
                else [],
            )
            for case, engine in pairs
        ]

    monkeypatch.setattr(Bench, "run", run)
    case = cases.Case(7, "plane", "dual_proxy", 7, {"delay": {}, "dead link": {}})
    bench = a_bench()
    (before,) = bench.run([(case, "drake")])
    (after,) = bench.shrink([before])
    assert set(after.case.factors) == {"delay"}
    assert {engine for _, engine in ran} == {"drake"}
    assert after.command == "dual-proxy stress --case 7 --only delay --engine drake"
    # It has its own row beside one of the other engine.
    both = [after, after._replace(engine="bare")]
    assert [
        row.split(" | ")[2] for row in command._failures(both).splitlines()[2:]
    ] == [*("drake", "bare")]
    regions = command._regions(both).splitlines()
    assert regions[2].startswith("| all | 1 | 0 | 100 % of 1 | 0 % of 1 |")
    assert regions[-1].startswith(
        "| some of all, again in Drake | 1 | 0 | 100 % of 1 |"
    )


def test_what_is_shrunk_breaks_the_same_limits(monkeypatch):
    """Without its delay the case breaks one of them, and less of it."""
    fast = "joint 3 speed 45.2 rad/s at 7 s (limit 2.61)"
    beyond = "joint 4 position -2.2 rad at 7 s (limit -0.07)"

    def run(self, pairs):
        return [
            an_outcome(
                case,
                safety=[fast, beyond]
                if "delay" in case.factors
                else ["joint 1 speed 2.3 rad/s at 7 s (limit 2.175)"],
            )
            for case, _ in pairs
        ]

    monkeypatch.setattr(Bench, "run", run)
    case = cases.Case(7, "plane", "tdpa", 7, {"delay": {}, "dead link": {}})
    bench = a_bench()
    (before,) = bench.run([(case, "bare")])
    assert before.verdict.limits == ["joint speed", "joint position"]
    (after,) = bench.shrink([before])
    assert after.factors == "delay"


def test_of_each_block_one_that_drake_can_simulate_is_run_in_it():
    bench = a_bench()
    drawn = [bench.draw(number) for number in range(60)]
    picked = command._sample(bench, drawn, 20)
    assert [case.number // 20 for case in picked] == [0, 1, 2]
    for case in picked:
        assert BASES[case.scene].robot == "panda"
        assert not set(case.factors) & {"model", "bad input"}
    assert command._sample(bench, drawn, 0) == []


def test_what_of_other_schemes_is_not_stable_has_an_example_of_each_kind():
    def of(number, scheme, *stability, factors=2, **others):
        names = list(cases.FACTORS)[:factors]
        case = cases.Case(number, "plane", scheme, number, {key: {} for key in names})
        return an_outcome(
            case, stability=[f"{text} 1 N" for text in stability], **others
        )

    outcomes = [
        of(1, "tdpa", "rest_device_force", "rest_contact_force"),
        of(2, "tdpa", "rest_device_force", "device_energy", factors=1),
        of(3, "four_channel", "motion_error"),
        of(4, "four_channel", "motion_error", safety=["joint 1"]),  # Listed elsewhere.
        of(5, "dual_proxy", "motion_error"),  # Likewise.
        of(6, "four_channel"),
        of(7, "four_channel", "motion_error", not_made="it died"),
    ]
    groups = command._group_unstable(outcomes)
    numbers = {key: [o.case.number for o in group] for key, group in groups.items()}
    assert numbers == {
        ("tdpa", "rest"): [1, 2],
        ("tdpa", "device_energy"): [2],
        ("four_channel", "motion_error"): [3],
    }
    examples = [min(group, key=command._size) for group in groups.values()]
    assert [example.case.number for example in examples] == [2, 2, 3]
    rows = command._unstable(groups, examples).splitlines()[2:]
    assert rows[-1].startswith("| tdpa | rest | 2 | delay |")
    assert rows[-1].endswith("| `dual-proxy stress --case 2 --only delay` |")


def test_a_case_is_repeated_by_its_command(capsys, tmp_path):
    """With an exit status, and what fails beside its limit."""
    assert main(["stress", "--case", "307"]) == 3
    text, error = capsys.readouterr()
    wanted = "rest_contact_force 2.928 N, not 0.3 or less"
    assert wanted in error
    assert error.count("\n") == 1
    (line,) = (line for line in text.splitlines() if line.startswith("to repeat it: "))
    words = shlex.split(line.removeprefix("to repeat it: "))
    assert words[:3] == ["dual-proxy", "stress", "--case"]
    assert main([*words[1:], "--out", str(tmp_path)]) == 3
    again = capsys.readouterr().out
    assert f"wrong: {wanted}" in again
    assert "rest_contact_force           2.928 N" in again
    # What runs there is in a file, too.
    scenario = dp.load_scenario(tmp_path / "case-307.yaml")
    drawn = a_bench().draw(307)
    assert scenario.device.hand_mass == drawn.factors["hand"]["device.hand_mass"]
    assert scenario.seed == 307
    # Without noise nothing is wrong.
    assert main(["stress", "--case", "307", "--only", "hand, sensor"]) == 0
    assert "wrong: nothing" in capsys.readouterr().out


def workers_die(monkeypatch, times):
    """As with `kill -9`, before so many runs."""
    work = many_runs._Worker.work
    left = [times]

    def die_first(self, job):
        if left[0] > 0:
            left[0] -= 1
            self.kill()
        return work(self, job)

    monkeypatch.setattr(many_runs._Worker, "work", die_first)


def test_a_run_whose_process_dies_is_made_again(monkeypatch):
    job = Job("a", change_scenario("plane", overrides={"duration": 1.0}), "bare", 0.5)
    wanted = many_runs.run_many([job], progress=lambda _: None)
    workers_die(monkeypatch, 1)
    assert many_runs.run_many([job], progress=lambda _: None) == wanted
    workers_die(monkeypatch, 2)
    (result,) = many_runs.run_many([job], progress=lambda _: None)
    why = "not made: the process of the run ended with exit code -9, 2 times"
    assert result == Result(None, why, 3, not_made=True)


def test_no_memory_is_no_failure_of_a_run(monkeypatch):
    def watch_too_much(*_):
        raise MemoryError

    monkeypatch.setattr(many_runs, "watch", watch_too_much)
    result, _ = many_runs._work(Job("a", dp.load_scenario("plane"), "bare", 1.0))
    assert result.not_made
    assert "MemoryError" in result.failure


def test_runs_that_are_not_there_are_no_failures(monkeypatch, tmp_path, capsys):
    workers_die(monkeypatch, 10**9)
    plan = Plan(cases=3, drake_every=0, map_steps=0, hours=0.01)
    tables, failures, not_made = stress(plan, 0, tmp_path, 2, progress=lambda _: None)
    assert failures == []
    assert len(not_made) == 4
    assert "ended with exit code -9" in not_made[0]
    assert "| not made: the process" in tables["day"]
    head, _, row, *_ = tables["regions"].splitlines()
    assert head.endswith(" | not made |")
    assert row == "| all | 3 | 0 | - | - | - | - | 3 |"
    monkeypatch.setattr(command, "QUICK", plan)
    arguments = ["stress", "--quick", "--jobs", "2", "--out", str(tmp_path)]
    assert main(arguments) == 4
    assert "error: 4 runs could not be made, the first " in capsys.readouterr().err
    # They are made the next time.
    monkeypatch.undo()
    again = stress(plan, 0, tmp_path, 2, progress=lambda _: None)
    assert again.not_made == []
    assert "not made" not in again.tables["regions"]


def test_stress_goes_on_where_it_was(tmp_path, capsys):
    plan = Plan(cases=12, drake_every=0, map_steps=0, hours=0.01)
    lines = []
    tables = stress(plan, 0, tmp_path, 2, progress=lines.append).tables
    assert tables["regions"].startswith("| of | cases |")
    again = []
    assert stress(plan, 0, tmp_path, 2, progress=again.append).tables == tables
    assert "there already" in again[0]
    assert not [line for line in again if "/" in line.split()[0]]
    record = json.loads((tmp_path / "stress.json").read_text())
    assert len(record["cases"]) == 12
    # Less does not take its place, and says so before it runs.
    with pytest.raises(dp.ScenarioError, match="holds cases 0 to 11"):
        stress(plan._replace(cases=3), 0, tmp_path, 2)
    with pytest.raises(dp.ScenarioError, match=r"another folder \(--out\)"):
        stress(plan, 1, tmp_path, 2)


def test_the_day_is_beside_the_others_or_after_them(monkeypatch, tmp_path):
    plan = Plan(cases=3, drake_every=0, map_steps=0, hours=0.01)
    orders = []

    def run(self, pairs):
        orders.append([case.number for case, _ in pairs])
        return [an_outcome(*pair) for pair in pairs]

    monkeypatch.setattr(Bench, "run", run)
    monkeypatch.setattr(Bench, "long_case", lambda *_: a_case(-1))
    monkeypatch.setattr(command, "_day", lambda day, _: str(day.case.number))
    for jobs in (1, 2):
        report = stress(plan, 0, tmp_path, jobs, progress=print)
        assert report.tables["day"] == "-1"
    assert [order for order in orders if order] == [[0, 1, 2, -1], [-1, 0, 1, 2]]


def a_case(number):
    return cases.Case(number, "plane", "dual_proxy", 0, {})


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

        report = stress(
            plan,
            0,
            tmp_path / "cluster",
            progress=kill_one,
            cluster=cluster.scheduler_address,
        )
    assert killed
    here = stress(plan, 0, tmp_path / "here", 2, progress=print)
    assert report.tables == here.tables


def test_a_cluster_without_workers_is_given_up(monkeypatch, tmp_path, capsys):
    distributed = pytest.importorskip("distributed", reason="extra `cluster`")
    monkeypatch.setattr(many_runs, "_TELL", 0.2)
    monkeypatch.setattr(many_runs, "_GIVE_UP", 1.0)
    out = tmp_path / "out"
    with distributed.LocalCluster(n_workers=0, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        arguments = ["--quick", "--cases", "2", "--cluster", address, "--out", str(out)]
        assert main(["stress", *arguments]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        f"cluster {address}: no workers; waiting for one",
        f"dual-proxy: error: cluster {address}: no workers for 1 s",
    ]
    assert not out.exists()


def test_a_cluster_that_is_not_there_is_said(tmp_path, capsys):
    out = tmp_path / "out"
    arguments = ["--quick", "--cluster", "nowhere", "--out", str(out)]
    assert main(["stress", *arguments]) == 2
    assert "cluster" in capsys.readouterr().err
    assert not out.exists()


def ranges(*names, rows=None, steps=2, workers=2):
    return maps.find_ranges(None, names, rows, steps, workers, lambda _: None)


def test_ranges_are_what_is_stable(monkeypatch, tmp_path):
    name = "force gain, sensor delay"
    two = maps.MAPS[name]._replace(values=(0.0, 0.016))
    monkeypatch.setitem(maps.MAPS, name, two)
    found = ranges(name, rows=["1e4 N/m"])
    by_delay = {cell.value: cell for cell in found}
    for delay, low, high in ((0.0, 30, 100), (0.016, 3, 10)):
        cell = by_delay[delay]
        assert cell.low == 0.1
        assert low < cell.high < high
        assert cell.ranges == 1
        assert "rest_" in cell.why
    maps.draw_maps(found, tmp_path / "maps.png")
    assert (tmp_path / "maps.png").stat().st_size > 1e4


def make_up(monkeypatch, is_stable):
    """Have a stiffness decide alone; return the names of the runs."""
    names = []

    def run(jobs, *_):
        names.extend(job.name for job in jobs)
        return [is_stable(job.scenario.scene.contact_stiffness) for job in jobs]

    def judge(result, _):
        if isinstance(result, str):
            return maps._Tried("", result)
        return maps._Tried("" if result else "rest_device_force 1 N")

    monkeypatch.setattr(maps, "run_many", run)
    monkeypatch.setattr(maps, "_what_is_wrong", judge)
    return names


@pytest.mark.parametrize(
    ("is_stable", "text"),
    [
        (lambda k: True, "all"),
        (lambda k: False, "none"),
        (lambda k: k < 2e4, "1e2 - 1.9e4"),
        (lambda k: k > 150, "1.6e2 - 1e6"),  # Not at the softest alone.
        (lambda k: k < 200 or 2e3 < k < 4e5, "2.1e3 - 3.9e5 (1 of 2)"),
        (lambda k: k < 2e3 or 4e3 < k < 1.5e4, "1e2 - 1.9e3 (1 of 2)"),
        (lambda k: 9e3 < k < 11e3, "9.4e3 - 1e4"),
        (lambda k: "it died" if 2e4 < k < 4e4 else True, "not made"),
        # At the grid's 1e5 by chance: the edge is ragged.
        (lambda k: k < 3.5e4 or 0.9e5 < k < 1.1e5, "1e2 - 3.4e4 (1 of 2)"),
        (
            lambda k: k < 8e3 or 1.2e4 < k < 2e4 or 9.9e3 < k < 10.1e3,
            "1e2 - 7.9e3 (1 of 3)",
        ),
    ],
)
def test_a_cell_is_the_widest_range(monkeypatch, is_stable, text):
    names = make_up(monkeypatch, is_stable)
    found = ranges("sensor delay", rows=["dual_proxy"], steps=5)
    assert {maps.cell_text(cell) for cell in found} == {text}
    # Nine on the grid, then the ends that are within and what is inside of them: once,
    # and again where that moves them.
    assert len(names) <= len(found) * (9 + 2 * 2 * (5 + 6))


def test_a_lab_maps_its_own_values(monkeypatch, tmp_path, capsys):
    name = "force gain, torque delay"
    one = maps.MAPS[name]
    rows = {"1e4 N/m": one.rows["1e4 N/m"]}
    monkeypatch.setitem(maps.MAPS, name, one._replace(rows=rows, values=(3.0,)))
    tables = {}
    for delay in ("0", "0.008"):
        words = ["--map", name, "--set", f"sensor.delay={delay}"]
        out = str(tmp_path / delay)
        assert main(["stress", *words, "--out", out]) == 0
        tables[delay] = capsys.readouterr().out.splitlines()[4]
        assert (tmp_path / delay / "map.png").stat().st_size > 1e4
    assert tables["0"].startswith("| 1e4 N/m | 0.1 - ")
    assert tables["0"] != tables["0.008"]


def test_a_static_offset_is_not_unstable():
    """position_force follows 8 mm behind at 1e3 N/m, and rests; it swings at 1e4."""
    base = change_scenario("plane", scheme="position_force", overrides=maps._press())
    for stiffness, rests in ((1e3, True), (1e4, False)):
        scenario = base.with_overrides({"scene.contact_stiffness": stiffness})
        watched = watch(scenario, rest_time(scenario))
        assert watched["motion_error"]["value"] > 5e-3
        tried = maps._what_is_wrong(Result(watched), scenario)
        assert (tried.wrong == "") == rests


def test_a_map_is_the_same_when_a_worker_dies(monkeypatch):
    name = "force gain, torque delay"
    one = maps.MAPS[name]._replace(values=(4.0,))
    monkeypatch.setitem(maps.MAPS, name, one)
    wanted = ranges(name, rows=["1e4 N/m"], steps=1)
    workers_die(monkeypatch, 1)
    assert ranges(name, rows=["1e4 N/m"], steps=1) == wanted


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--cases", "0"], "cases: expected 1 to 100000, got 0"),
        (["--cases", "100001"], "cases: expected 1 to 100000, got 100001"),
        (["--first", "-1"], "first: expected at least 0, got -1"),
        (["--case", "-1"], "case: expected at least 0, got -1"),
        (["--jobs", "0"], "jobs: expected at least 1, got 0"),
        (["--case", "1", "--cases", "5"], "--cases: expected without --case"),
        (["--case", "1", "--first", "9"], "--first: expected without --case"),
        (["--case", "1", "--quick"], "--quick: expected without --case"),
        (["--case", "1", "--page", "x.md"], "--page: expected without --case"),
        (["--case", "1", "--cluster", "xx"], "--cluster: expected without --case"),
        (["--only", "hand"], "--only: expected with --case"),
        (["--set", "duration=3"], "--set: expected with --map"),
        (["--map", "x"], "--map: expected one of delay; control period; "),
        (["--map", "delay", "--case", "3"], "--case: expected without --map"),
        (["--map", "delay", "--set", "link.delay=1"], "link.delay: expected another"),
        (["--map", "delay", "--set", "link.dely=1"], "unknown key 'dely'"),
        (["--engine", "drake"], "--engine: expected with --case"),
        (["--case", "307", "--only", "delay"], "or nothing, got 'delay'"),
        (["--quick", "--page", "x.md"], "--page: expected the whole benchmark"),
    ],
)
def test_bad_arguments_are_one_line(arguments, problem, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["stress", "--out", str(out), *arguments]) == 2
    error = capsys.readouterr().err
    assert problem in error
    assert error.count("\n") == 1
    assert not out.exists()


def test_one_case_is_explained(capsys):
    assert main(["stress", "--case", "1"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("case 1: ")
    assert "wrong: nothing" in text
    assert "dual-proxy stress --case 1 --only" in text
