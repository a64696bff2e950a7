# SPDX-License-Identifier: BSD-3-Clause
"""`dual-proxy bench`, the quick part of it."""

import dataclasses
import json
import math
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from dual_proxy import cli
from dual_proxy.bench import (
    closed_loop,
    control,
    engine,
    filter_command,
    filter_recordings,
    filter_report,
    filter_situations,
    link,
    pages,
    peer,
    plant,
    savings,
)
from dual_proxy.bench import filter as bench
from dual_proxy.settings import ScenarioError

# A directory with recordings of a guided arm, if there is one.
RECORDINGS = os.environ.get("DUAL_PROXY_RECORDINGS")
MARKS = "".join(
    f"<!-- dual-proxy bench filter: {name} -->\n\nText after {name}.\n\n"
    for name in ("grid", "targets", "situations", "dependence")
)


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """Run the command once; return where it saves."""
    out = tmp_path_factory.mktemp("bench")
    assert cli.main(["bench", "filter", "--quick", "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def results(quick):
    return json.loads((quick / "filter.json").read_text())


def rows(results, table="grid", **where):
    return [
        row
        for row in results[table]
        if all(row[key] == value for key, value in where.items())
    ]


def test_every_setting_has_its_rows(results):
    settings = len(bench.LIKELIHOODS) * 2 * 3
    assert len(rows(results, scene=None, drive=None, friction=None)) == settings
    for scene in ("free", "plane", "cylinder", "inner_corner", "step_edge"):
        assert len(rows(results, scene=scene)) == settings
    for drive in ("closed_loop", "true_selection", "kinematic"):
        assert len(rows(results, drive=drive)) == settings
    for friction in (0.0, 0.25, 0.5):
        assert len(rows(results, friction=friction)) == settings
    assert len(results["still"]) == len(bench.LIKELIHOODS) * 3 * 3
    assert results["recordings"] == []
    assert results["machine"]["processors"] >= 1


def test_free_space_is_never_a_contact(results):
    for row in rows(results, scene="free"):
        assert row["false_contact_samples"] == 0
        assert row["dimension_changes"] == 0
        assert row["samples"] > 500
        assert row["contact_samples"] == 0


def test_values_are_possible(results):
    for row in rows(results, drive=None, friction=None):
        if row["scene"] == "free":
            continue
        assert 0 <= row["dimension_right"] <= 1
        for name in ("direction_error", "axis_error"):
            mean, p95 = row[f"{name}_mean_deg"], row[f"{name}_p95_deg"]
            assert (mean is None) == (p95 is None)
            assert mean is None or (0 <= mean <= 90 and 0 <= p95 <= 90)
        for name in ("detection", "loss", "second"):
            assert row[f"{name}_missed"] <= row[f"{name}_events"]
        assert row["detection_events"] >= row["trials"]
        # Only in a corner is there a second wall.
        in_corner = row["scene"] in (None, "inner_corner", "step_edge")
        assert (row["second_events"] > 0) == in_corner


def test_more_particles_cost_more(results):
    for likelihood in bench.LIKELIHOODS:
        few, many = (
            sum(
                row["cost_us_per_s"]
                for row in rows(results, likelihood=likelihood, num_particles=number)
                if "cost_us_per_s" in row
            )
            for number in (100, 1000)
        )
        assert many > 1.5 * few


def test_the_filter_is_of_use_in_closed_loop(results):
    # With slack, at the rate that the printed method is made for; what is reached
    # is in docs/benchmarks.md.
    where = {"drive": "closed_loop", "num_particles": 1000, "rate": 15.0}
    found = rows(results, **where)
    assert len(found) == len(bench.LIKELIHOODS)
    for row in found:
        assert row["dimension_right"] > 0.5
        assert row["direction_error_mean_deg"] < 25
        assert row["detection_missed"] == 0


def test_output_is_readable(quick, results):
    assert (quick / "filter.png").stat().st_size > 10000
    assert not list(quick.glob("*.unfinished"))
    table = filter_report.target_table(results).splitlines()
    assert len({line.count("|") for line in table}) == 1
    for likelihood in bench.LIKELIHOODS:
        assert f"{likelihood}, 100 Hz" in table[0]
    free = next(line for line in table if line.startswith("| free"))
    assert free.count("0: met") == 3 * len(bench.LIKELIHOODS)
    assert "not met" not in free


def test_every_situation_is_held_against_its_targets(results):
    names = list(filter_situations.SITUATIONS)
    for likelihood in bench.LIKELIHOODS:
        for rate in filter_report.SITUATION_RATES:
            of_setting = rows(results, "situations", likelihood=likelihood, rate=rate)
            assert [row["situation"] for row in of_setting] == names
            for row in of_setting:
                is_free = "free" in row["situation"]
                assert (row["contact_samples"] == 0) == is_free
                # The printed method says nothing of its own accuracy.
                for key in ("coverage", "confidence"):
                    value = row[key]
                    assert (value is None) == (is_free or likelihood == "paper")
                    assert value is None or 0 <= value <= 1
                assert 0 <= row["false_contact_share"] <= 1
    lines = filter_report.situation_table(results).splitlines()
    assert len(lines) == 3 + len(names) * len(filter_report.SITUATION_RATES)
    assert len({line.count("|") for line in lines}) == 1
    assert "friction_cone: coverage" in lines[0]
    assert "paper: coverage" not in lines[0]


def test_what_misses_a_target_is_bold():
    def cells(**values):
        row = {
            "direction_error_mean_deg": 4.0,
            "direction_error_p95_deg": 9.0,
            "dimension_right": 0.96,
            "coverage": 0.95,
            "confidence": 0.97,
            "false_contact_share": 0.0,
        }
        return [column.cell(row | values) for column in filter_report.SITUATION_COLUMNS]

    assert cells() == ["4 / 9", "0.96", "0.95", "0.97", "0"]
    assert cells(coverage=0.85)[:3] == ["**4 / 9**", "0.96", "**0.85**"]
    assert cells(coverage=0.99)[:3] == ["4 / 9", "0.96", "**0.99**"]
    assert cells(coverage=None)[:3] == ["**4 / 9**", "0.96", "-"]
    assert cells(dimension_right=0.94)[1] == "**0.94**"
    assert cells(confidence=0.8, false_contact_share=3e-4)[3:] == [
        *("**0.8**", "**0.0003**")
    ]


def test_results_do_not_depend_on_the_number_of_workers():
    plan = dataclasses.replace(bench.QUICK, num_particles=(100,), rates=(15.0,))
    grids = []
    for workers in (1, 3):
        with bench.worker_pool(workers) as pool:
            grid = bench.measure_grid(plan, pool)
        for row in grid:
            row.pop("cost_us_per_s", None)
        grids.append(grid)
    assert grids[0] == grids[1]


def test_full_plan_meets_each_pair_of_drive_friction_speed_and_force():
    trials = [trial for trial in bench.FULL.trials() if trial.scene == "plane"]
    for a, b in (
        *(("drive", "friction"), ("drive", "speed"), ("drive", "force")),
        *(("friction", "speed"), ("friction", "force"), ("speed", "force")),
    ):
        pairs = {(getattr(trial, a), getattr(trial, b)) for trial in trials}
        assert len(pairs) == 9, (a, b)
    seeds = [trial.seed for trial in bench.FULL.trials()]
    assert len(set(seeds)) == len(seeds)


def test_quantile_of_latencies_knows_what_was_missed():
    class Result:
        samples = contact_samples = right_dimension_samples = 0
        dimension_changes = false_contact_samples = free_samples = 0
        stated_samples = covered_samples = 0
        confident_samples = confident_right_samples = 0
        direction_error = axis_error = np.array([])
        loss_latency = second_latency = np.array([])
        detection_latency = np.array([0.01] * 18 + [0.03] + [math.inf])

    row = bench._summary([Result()])
    assert row["detection_p95_ms"] is None
    assert row["detection_mean_ms"] == pytest.approx(11.05, abs=0.01)
    assert (row["detection_events"], row["detection_missed"]) == (20, 1)
    assert row["detection_late"] == 1 / 20
    assert row["second_late"] is None
    assert row["dimension_right"] is None
    Result.detection_latency = np.array([0.01] * 40 + [math.inf])
    assert bench._summary([Result()])["detection_p95_ms"] == pytest.approx(10)


def test_page_is_filled_and_filled_again(results, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"# Title\n\n{MARKS}")
    pages.check_page(page, False, filter_report.PAGE_TABLES)
    filter_report.write_page(page, results)
    once = page.read_text()
    for name in ("grid", "targets", "situations", "dependence"):
        mark = f"<!-- dual-proxy bench filter: {name} -->\n| "
        assert mark in once
        assert f"|\n\nText after {name}.\n\n" in once
    filter_report.write_page(page, results)
    assert page.read_text() == once
    assert (tmp_path / "images" / "bench_filter.png").is_file()


def run_quick(subject, out):
    """Run a subject's command; return what it saved and where."""
    assert cli.main(["bench", subject.name, "--quick", "--out", str(out)]) == 0
    assert (out / f"{subject.name}.png").stat().st_size > 10000
    results = json.loads((out / f"{subject.name}.json").read_text())
    for table in subject.tables(results).values():
        assert len({line.count("|") for line in table.splitlines()}) == 1
    return results


def check_page(subject, results, page):
    """A page with the subject's marks is filled, and nothing else is changed."""
    text = "".join(f"<!-- {mark} -->\n\nAfter {mark}.\n\n" for mark in subject.marks)
    page.write_text(text)
    pages.check_page(page, False, subject.marks)
    subject.write_page(page, results)
    filled = page.read_text()
    assert list(subject.tables(results)) == list(subject.marks)
    for mark in subject.marks:
        assert f"<!-- {mark} -->\n| " in filled
        assert f" |\n\nAfter {mark}.\n" in filled
    assert (page.parent / "images" / f"bench_{subject.name}.png").is_file()


@pytest.fixture(scope="module")
def engines(tmp_path_factory):
    """Run `bench engine` once; return what it measured."""
    return run_quick(engine.SUBJECT, tmp_path_factory.mktemp("engine"))


@pytest.fixture(scope="module")
def engine_rows(engines):
    return engines["rows"]


def test_every_engine_and_step_has_its_row(engine_rows):
    assert [(row["engine"], row["step_ms"]) for row in engine_rows] == [
        (name, step) for name in ("drake", "bare") for step in (0.5, 1.0, 2.0)
    ]
    for row in engine_rows:
        assert row["us_per_ms"] > 0
        for phase in engine.PHASES:
            assert all(0 <= error < math.inf for error in row[phase].values())
        assert row["free"]["force_N"] == 0
    table = engine.engine_table(engine_rows).splitlines()
    assert len(table) == 2 + len(engine_rows)


def test_finer_steps_have_smaller_errors(engine_rows):
    for name in ("drake", "bare"):
        of_engine = [row for row in engine_rows if row["engine"] == name]
        for phase in engine.PHASES:
            for key in ("position_um", "force_N")[: 1 if phase == "free" else 2]:
                errors = [row[phase][key] for row in of_engine]
                assert errors == sorted(errors), (name, phase, key)


def test_bare_is_faster_and_sticks_better_at_equal_step(engine_rows):
    drake, bare = engine_rows[:3], engine_rows[3:]
    for one, other in zip(drake, bare, strict=True):
        assert other["us_per_ms"] < one["us_per_ms"] / 2
        for key in ("position_um", "force_N"):
            assert other["sliding"][key] < one["sliding"][key]


def test_errors_of_engines_are_deterministic(engine_rows):
    plan = engine.Plan((1e-3,), engine.QUICK.reference_step, repeats=1)
    again = engine.measure(plan)
    for row in again:
        (before,) = (
            old
            for old in engine_rows
            if (old["engine"], old["step_ms"]) == (row["engine"], 1.0)
        )
        assert row | {"us_per_ms": 0} == before | {"us_per_ms": 0}


def test_page_of_engines_is_filled(engines, tmp_path):
    check_page(engine.SUBJECT, engines, tmp_path / "page.md")


def test_turns_have_equal_pieces_and_are_timed():
    seen = {"a": [], "b": []}
    begins = []
    costs = closed_loop.take_turns(
        {name: times.append for name, times in seen.items()}, 2.0, 1.0, begins.append
    )
    assert begins == pytest.approx([1.0, 1.25, 1.5, 1.75])
    for name, times in seen.items():
        assert times == pytest.approx([1.25, 1.5, 1.75, 2.0])
        assert costs[name].shape == (4,)
        assert (costs[name] >= 0).all()


def test_yardstick_is_one_yardstick_long():
    _, cost = closed_loop.simulate("bare", closed_loop.quiet_scenario({}))
    # With slack, as both are some milliseconds.
    assert 0.5 < cost.yardsticks < 2.0


def test_errors_against_itself_are_zero():
    log, _ = closed_loop.simulate("bare", closed_loop.quiet_scenario({}))
    errors = closed_loop.phase_errors(log, log)
    assert set(errors["free"]) == {"position_um", "force_N", "tilt_deg"}
    for phase in closed_loop.PHASES:
        assert set(errors[phase].values()) == {0.0}


@pytest.fixture(scope="module")
def controls(tmp_path_factory):
    """Run `bench control` once; return what it measured."""
    return run_quick(control.SUBJECT, tmp_path_factory.mktemp("control"))


def test_every_rate_has_its_row_with_each_of_what_is_between(controls):
    plan, rows = control.QUICK, controls["rows"]
    assert [(row["between"], row["rate_Hz"]) for row in rows] == [
        (between.name, rate) for between in plan.between for rate in plan.rates
    ]
    for row in rows:
        assert row["us_per_ms"] > 0
        assert row["yardsticks"] > 0
        assert row["stable"] == row["runs"] == plan.seeds
        assert 0 < row["hand_ac_N"] < 0.5
        assert 0 < row["tracking_m"] < 0.005
        assert 0 < row["normal_deg"] < 5


def test_faster_control_has_smaller_errors(controls):
    for between in control.QUICK.between:
        rows = [row for row in controls["rows"] if row["between"] == between.name]
        errors = [row["force_N"] for row in rows]
        assert errors == sorted(errors, reverse=True), between.name


def test_what_is_between_costs_accuracy(controls):
    def errors(between: str, key: str) -> np.ndarray:
        rows = controls["rows"]
        return np.array([row[key] for row in rows if row["between"] == between])

    force = errors("nothing", "force_N")
    assert (errors("low-pass 20 Hz", "force_N") > force).all()
    assert (errors("sensor 8 ms late", "force_N") > 1.5 * force).all()
    # Motion control has no integral: torques that round off to none leave it be.
    position = errors("nothing", "position_um")
    assert (errors("torques in steps of 0.03 N m", "position_um") > 3 * position).all()


def test_page_of_control_is_filled(controls, tmp_path):
    check_page(control.SUBJECT, controls, tmp_path / "page.md")


@pytest.fixture(scope="module")
def links(tmp_path_factory):
    """Run `bench link` once; return what it measured."""
    return run_quick(link.SUBJECT, tmp_path_factory.mktemp("link"))


def test_messages_are_as_long_as_what_they_hold():
    # A pose is position and rotation matrix, 12; both selections and the normals
    # are 9 each; a force is 3.
    assert link.message_numbers("dual_proxy") == (39, 39)
    assert link.message_numbers("position_force") == (39, 3)
    assert link.message_numbers("position_position") == (39, 39)


def test_every_scheme_rate_and_option_has_its_row(links):
    plan, rows = link.QUICK, links["rows"]
    usual = [row for row in rows if row["average"] and row["interpolate"]]
    schemes = ("dual_proxy", "position_force", "position_position")
    assert [(row["scheme"], row["rate_Hz"]) for row in usual] == [
        (scheme, rate) for scheme in schemes for rate in plan.rates
    ]
    others = [row for row in rows if not (row["average"] and row["interpolate"])]
    assert len(others) == 3 * len(plan.rates)
    assert {row["scheme"] for row in others} == {"dual_proxy"}
    for row in usual:
        message = 2 * 24 + 8 * (42 if row["scheme"] == "position_force" else 78)
        assert row["bytes_per_s"] == message * row["rate_Hz"]
    options = link.options_table(rows).splitlines()
    assert len(options) == 2 + 4 * len(plan.rates)


def test_more_bandwidth_tracks_better(links):
    for scheme in ("dual_proxy", "position_position"):
        errors = [
            row["tracking_m"]
            for row in links["rows"]
            if row["scheme"] == scheme and row["average"] and row["interpolate"]
        ]
        assert errors == sorted(errors, reverse=True), scheme
        assert 0 < errors[-1] < 0.01


def test_page_of_links_is_filled(links, tmp_path):
    check_page(link.SUBJECT, links, tmp_path / "page.md")


@pytest.fixture(scope="module")
def plants(tmp_path_factory):
    """Run `bench plant` once; return what it measured."""
    return run_quick(plant.SUBJECT, tmp_path_factory.mktemp("plant"))


def test_every_case_of_a_plant_has_its_row(plants):
    steps = [1e3 * step for step in plant.QUICK.steps]
    cases = [
        (scene, stiffness)
        for scene, (_, stiffnesses) in plant.QUICK.scenes.items()
        for stiffness in stiffnesses
    ]
    keys = ("scene", "stiffness_N_m", "approximation", "step_ms")
    found = [tuple(row[key] for key in keys) for row in plants["rows"]]
    expected = []
    for case in cases:
        expected.append((*case, plant.BARE, 2e3 * plant.QUICK.reference_step))
        expected += [(*case, a, step) for a in plant.APPROXIMATIONS for step in steps]
    assert found == expected
    for row in plants["rows"]:
        # A plane's normal is exact.
        assert (row["sliding"]["normal_deg"] > 0) == (row["scene"] == "sim_cylinder")


def test_coarser_plants_are_faster_and_worse(plants):
    rows = [row for row in plants["rows"] if row["approximation"] != plant.BARE]
    for fine, coarse in zip(rows[::2], rows[1::2], strict=True):
        assert coarse["us_per_ms"] < fine["us_per_ms"]
        assert coarse["sliding"]["position_um"] > fine["sliding"]["position_um"]


def test_the_reference_is_nearer_to_its_limit_than_what_is_compared(plants):
    case: dict = {}
    for row in plants["rows"]:
        key = row["scene"], row["stiffness_N_m"]
        case.setdefault(key, []).append(row["sliding"])
    for reference, *others in case.values():
        for key in ("position_um", "force_N"):
            assert reference[key] < min(other[key] for other in others)


def test_page_of_plants_is_filled(plants, tmp_path):
    check_page(plant.SUBJECT, plants, tmp_path / "page.md")


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """Run `bench savings` once; return what it measured."""
    return run_quick(savings.SUBJECT, tmp_path_factory.mktemp("savings"))


def test_savings_save_and_change_nothing(saved):
    rows = {row["saving"]: row for row in saved["rows"]}
    assert len(saved["rows"]) == 8
    assert len(rows) == 7  # The point mass is held against both engines' arm.
    # Another robot, and the share of updates that found something.
    different = {"no arm, no MultibodyPlant"}
    counted = {"in free space the filter is exact and nearly free"}
    for name, row in rows.items():
        assert row["without"] > 0
        assert row["with"] > 0
        if name in counted:
            assert row["difference"] == {"false_contacts": 0}
        elif name not in different:
            assert row["difference"] == {}, name
    for name in different | counted:
        assert rows[name]["ratio"] > 1.5, name
    assert rows[counted.pop()]["ratio"] > 5


def test_difference_of_logs_is_of_what_both_have():
    log, _ = closed_loop.simulate("bare", closed_loop.quiet_scenario({}))
    assert savings._difference(log, log.drop(columns="torque_0")) == {}
    other = log.copy()
    other["robot_position_x"] += 1e-3
    assert savings._difference(log, other) == pytest.approx(
        {"position_m": 1e-3, "force_N": 0.0}
    )


def test_page_of_savings_is_filled(saved, tmp_path):
    check_page(savings.SUBJECT, saved, tmp_path / "page.md")


@pytest.fixture(scope="module")
def peers(tmp_path_factory):
    """Run `bench peer` once; return what it measured."""
    for module in ("mujoco", "pinocchio"):
        pytest.importorskip(module, reason=f"{module} is not installed (extra bench)")
    return run_quick(peer.SUBJECT, tmp_path_factory.mktemp("peer"))


def test_every_contender_has_its_row(peers):
    rows = {row["contender"]: row for row in peers["rows"]}
    assert len(rows) >= 6
    for name in ("bare engine", "Drake, loop in Python", "MuJoCo, NumPy"):
        assert 0 < rows[name]["force_N"] < 3
        assert 0 < rows[name]["along_um"] < 1e4
        assert rows[name]["yardsticks"] > 0
    # The same controller with equal terms, to rounding.
    numpy, pinocchio = (
        rows[name]["along_um"]
        for name in ("MuJoCo, NumPy", "MuJoCo, NumPy with Pinocchio's terms")
    )
    assert pinocchio == pytest.approx(numpy, rel=0.1)
    alone = rows["MuJoCo's plant alone"]
    assert alone["force_N"] is None
    assert alone["us_per_ms"] < rows["MuJoCo, NumPy"]["us_per_ms"]


def test_page_of_peers_is_filled(peers, tmp_path):
    check_page(peer.SUBJECT, peers, tmp_path / "page.md")


def test_the_arm_of_the_peers_is_ours(peers):
    import mujoco

    from dual_proxy.bench import mujoco_arm
    from dual_proxy.panda import PandaModel
    from dual_proxy.scenario import load_scenario

    path = mujoco_arm.Path(np.zeros((1, 3)), np.zeros((1, 3)))
    model = PandaModel()
    for q, v in (np.random.default_rng(0).uniform(-1, 1, (5, 2, 7)) * 0.8)[:]:
        arm = mujoco_arm.MujocoArm(load_scenario("plane"), path, q)
        arm._data.qvel[:] = v
        mujoco.mj_forward(arm._model, arm._data)
        ours = model.calc(q, v)
        expected = (
            ours.p_BE,
            ours.R_BE,
            ours.J_BE,
            ours.mass,
            ours.bias - ours.gravity,
        )
        for terms in (arm.calc_terms(), mujoco_arm.PinocchioTerms().calc(q, v)):
            for value, right in zip(terms, expected, strict=True):
                assert value == pytest.approx(right, abs=1e-9)


def test_without_the_peers_there_is_one_clear_line(capsys, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)  # As if it were not there.
    status = cli.main(["bench", "peer", "--quick", "--out", str(tmp_path)])
    captured = capsys.readouterr()
    assert status == 2
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert "pip install 'drake-dual-proxy[bench]'" in captured.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "required: SUBJECT"),
        (["engine", "--page", __file__], "expected a line '<!-- dual-proxy bench"),
        (["engine", "--quick", "--page", "x.md"], "expected the whole benchmark"),
        (["arm"], "invalid choice: 'arm'"),
        *(
            (
                [name, "--page", __file__],
                f"expected a line '<!-- dual-proxy bench {name}",
            )
            for name in ("link", "plant", "savings", "peer")
        ),
        (["control", "--quick", "--page", "x.md"], "expected the whole benchmark"),
        (["control", "--page", __file__], "expected a line '<!-- dual-proxy bench"),
        (["filter", "--page", "no.md"], "--page no.md: No such file"),
        (["filter", "--page", __file__], "expected a line '<!-- dual-proxy bench"),
        (["filter", "--quick", "--page", "x.md"], "expected the whole benchmark"),
        (["filter", "--recordings", "no"], "--recordings no: expected CSV files"),
        (["filter", "--out", __file__], "--out"),
        (["filter", "--jobs", "0"], "jobs: expected at least 1, got 0"),
        (["control", "--jobs", "-1"], "jobs: expected at least 1, got -1"),
        (["plant", "--jobs", "2"], "unrecognized arguments: --jobs 2"),
        # No text.
        (["filter", "--page", sys.executable], "expected text in UTF-8"),
        (["control", "--page", sys.executable], "expected text in UTF-8"),
        # A folder in which nothing can be made.
        (["control", "--out", "/proc/self"], "--out /proc/self: "),
        (["filter", "--out", "/proc/self"], "--out /proc/self: "),
    ],
)
def test_bad_input_is_one_clear_line(capsys, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    try:
        status = cli.main(["bench", *arguments])
    except SystemExit as error:
        status = error.code
    captured = capsys.readouterr()
    assert status == 2
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert message in captured.err
    assert not list(tmp_path.iterdir())


def fill_out(out):
    """What is in the way of what is saved."""
    (out / "control.json").mkdir(parents=True)
    return ["--out", str(out)], f"--out {out}/control.json: Is a directory"


def fill_images(out):
    out.mkdir()
    page = out / "page.md"
    page.write_text("<!-- dual-proxy bench control -->\n\n")
    (out / "images").write_text("no folder")
    return ["--page", str(page)], f"--page {out}/images: Not a directory"


def fill_image(out):
    fill_images(out)
    (out / "images").unlink()
    (out / "images" / "bench_control.png").mkdir(parents=True)
    where = f"{out}/images/bench_control.png"
    return ["--page", str(out / "page.md")], f"--page {where}: Is a directory"


@pytest.mark.parametrize("fill", [fill_out, fill_images, fill_image])
def test_places_are_looked_at_first(capsys, tmp_path, monkeypatch, fill):
    def measure(*_):
        raise AssertionError("measured")

    monkeypatch.setattr(control, "SUBJECT", control.SUBJECT._replace(measure=measure))
    monkeypatch.chdir(tmp_path)
    arguments, message = fill(tmp_path / "place")
    before = sorted(tmp_path.rglob("*"))
    assert cli.main(["bench", "control", *arguments]) == 2
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", f"dual-proxy: error: {message}\n")
    assert sorted(tmp_path.rglob("*")) == before


def make_measured(monkeypatch, measure):
    """Let `bench control` measure so, and print and draw next to nothing."""
    subject = control.SUBJECT._replace(
        measure=measure,
        tables=lambda results: {"dual-proxy bench control": f"| {results['rows']} |"},
        draw=lambda _, path: path.write_bytes(b"drawn"),
    )
    monkeypatch.setattr(control, "SUBJECT", subject)


def test_tables_are_printed_whatever_can_be_saved(capsys, tmp_path, monkeypatch):
    out = tmp_path / "out"

    def measure(_):
        (out / "control.json").mkdir()  # Somebody else does.
        return {"rows": 42}

    make_measured(monkeypatch, measure)
    assert cli.main(["bench", "control", "--out", str(out)]) == 3
    captured = capsys.readouterr()
    assert "| 42 |" in captured.out
    assert captured.err == (
        f"dual-proxy: error: {out / 'control.json'}: Is a directory\n"
    )
    assert [path.name for path in out.iterdir()] == ["control.json"]


def test_what_fails_leaves_no_empty_folder(tmp_path, monkeypatch):
    def measure(_):
        raise KeyboardInterrupt

    make_measured(monkeypatch, measure)
    assert cli.main(["bench", "control", "--out", str(tmp_path / "a" / "b")]) == 3
    assert not list(tmp_path.iterdir())


def test_jobs_are_runs_at_a_time(tmp_path, monkeypatch):
    asked = []

    def run_many(runs, workers=None):
        asked.append(workers)
        raise KeyboardInterrupt

    def worker_pool(workers=None):
        asked.append(workers)
        raise KeyboardInterrupt

    monkeypatch.setattr(control, "run_many", run_many)
    monkeypatch.setattr(link, "run_many", run_many)
    monkeypatch.setattr(filter_command, "worker_pool", worker_pool)
    for subject in ("control", "link", "filter"):
        for jobs in ([], ["--jobs", "3"]):
            arguments = ["bench", subject, "--quick", "--out", str(tmp_path), *jobs]
            assert cli.main(arguments) == 3
    assert asked == 3 * [None, 3]


def test_a_page_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    page = tmp_path / "page.md"
    page.write_text(MARKS)
    pages.check_page(page, False, filter_report.PAGE_TABLES)
    monkeypatch.setattr(pages.os, "access", lambda *_: False)  # Root may anything.
    with pytest.raises(ScenarioError, match=f"--page {page}: Permission denied"):
        pages.check_page(page, False, filter_report.PAGE_TABLES)


def test_a_page_keeps_its_text_whatever_the_locale(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("µ ≥ 0\n<!-- here -->\n\nend\n", "utf-8")
    (tmp_path / "link.md").symlink_to(page)
    pages.fill_page(tmp_path / "link.md", "here", "| table |")
    assert page.read_text("utf-8") == "µ ≥ 0\n<!-- here -->\n| table |\n\nend\n"
    assert (tmp_path / "link.md").is_symlink()


def make_recording(path, seconds=4.0, rows_per_s=100.0, columns=True):
    """A tool that presses the board with 8 N from 1 s on, in a turned frame."""
    rotation = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, -1.0]])
    names = ["t", "sensed_fx", "sensed_fy", "sensed_fz", "px", "py", "pz"]
    names += [f"R{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)] + ["vx", "vy", "vz"]
    lines = [",".join(names if columns else names[:-1])]
    for k in range(round(seconds * rows_per_s)):
        time = k / rows_per_s
        force = 8.0 if time >= 1.0 else 0.0
        x = 0.02 * time
        values = [time, 0, 0, force, x, 0, 0.1, *rotation.ravel(), 0.02, 0, 0]
        values = values if columns else values[:-1]
        lines.append(",".join(f"{value:g}" for value in values))
    path.write_text("\n".join(lines) + "\n")


def test_recording_is_read_in_the_base_frame(tmp_path):
    make_recording(tmp_path / "a.csv")
    (recording,) = filter_recordings.read_recordings(tmp_path)
    assert recording.forces[-1] == pytest.approx([0, 0, -8])
    means = recording.means(1 / 15)
    assert len(means.times) == 60
    assert means.positions[-1] == pytest.approx(
        recording.positions[means_begin(recording, 59) :].mean(axis=0)
    )
    assert len(recording.means(0.01).times) == len(recording.times)
    config = bench.Config("paper", 1000, 100.0)
    (row,) = filter_recordings.measure_recordings([recording], [config])
    assert row["updates_pressing"] == 300
    assert row["normal_right"] > 0.9
    assert row["dimension_changes_per_s"] < 1


def means_begin(recording, period):
    return int(np.flatnonzero(recording.times * 15 + 1e-6 >= period)[0])


def test_recording_without_a_velocity_is_refused(tmp_path):
    make_recording(tmp_path / "a.csv", columns=False)
    with pytest.raises(ScenarioError, match="vz"):
        filter_recordings.read_recordings(tmp_path)


@pytest.mark.skipif(RECORDINGS is None, reason="DUAL_PROXY_RECORDINGS is not set")
def test_real_recordings():
    recordings = filter_recordings.read_recordings(Path(RECORDINGS))
    configs = [bench.Config(name, 1000, 15.0) for name in bench.LIKELIHOODS]
    for row in filter_recordings.measure_recordings(recordings, configs):
        assert row["updates_pressing"] > 100
        # With slack: 0.87 for the printed method.
        assert row["normal_right"] > 0.7


def test_every_period_is_timed():
    from dual_proxy.bench import cycle

    results = cycle.measure(True)
    table = cycle.cycle_table(results).splitlines()
    assert len(table) == 2 + len(results["rows"])
    for row in results["rows"]:
        assert row["cycles"] == 20_000
        assert 0 < row["median_us"] < row["p999_us"] <= row["max_us"]
        assert row["median_us"] < row["own_us"] <= row["max_us"]
        # A few where a run begins.
        assert row["page_faults"] < 100
