# SPDX-License-Identifier: BSD-3-Clause
import base64
import html
import html.parser
import re

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.claims import Verdict
from dual_proxy.metrics import METRICS, compute_metrics, format_metric
from dual_proxy.report import render_report, write_report
from dual_proxy.scenario import load_scenario

SECTIONS = (
    "Metrics",
    "Positions",
    "Forces",
    "Contact direction",
    "Link",
    "Torques",
    "Passivity",
    "Scenario",
)


@pytest.fixture
def scenario():
    return load_scenario("plane")


@pytest.fixture
def page(scenario, make_log):
    def page(rows=None, **arguments):
        log = make_log(scenario).iloc[:rows]
        return render_report(log, compute_metrics(log, scenario), scenario, **arguments)

    return page


class Checker(html.parser.HTMLParser):
    """Collects references and finds tags that do not close."""

    VOID = ("meta", "img", "br")

    def __init__(self):
        super().__init__()
        self.open, self.references = [], []

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append(tag)
        self.references += [v for k, v in attrs if k in ("src", "href")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def check(text):
    checker = Checker()
    checker.feed(text)
    assert checker.open == []
    return checker.references


def test_page_is_whole_self_contained_and_small(page):
    text = page(links=["log.npz"])
    references = check(text)
    pictures = [r for r in references if r.startswith("data:image/png;base64,")]
    assert len(pictures) == 6
    for picture in pictures:
        data = base64.b64decode(picture.partition(",")[2], validate=True)
        assert data.startswith(b"\x89PNG")
    assert [r for r in references if not r.startswith("data:")] == ["log.npz"]
    assert "http" not in text
    assert re.findall("<h2>(.*?)</h2>", text) == list(SECTIONS)
    assert len(text.encode()) < 2e6


def test_every_metric_with_unit_and_every_parameter_is_there(page, scenario):
    text = html.unescape(page())
    for key, entry in METRICS.items():
        number = '</td><td class="number">[^<]+</td>'
        limit = '<td class="limit">[^<]*</td>'
        if entry.limit is not None:
            bounds = {f"≥ {entry.limit.least:g}", f"≤ {entry.limit.most:g}"}
            limit = f'<td class="limit">({"|".join(bounds)})(, arm)?</td>'
        row = f"<code>{key}</code>{number}<td>{entry.unit}</td>{limit}"
        assert re.search(row, text), key
    assert scenario.to_yaml() in text


def test_claims_stand_beside_what_was_measured(page):
    claim = dp.Claim(
        metric="normal_error_mean_deg", at_most=5.0, paper="a < b\nc", source="VI"
    )
    text = page(verdicts=[Verdict(claim, 6.0, False), Verdict(claim, 4.0, True)])
    check(text)
    assert text.index("<h2>Claims</h2>") < text.index("<h2>Metrics</h2>")
    row = (
        "<td>a &lt; b c (VI)</td>"
        '<td class="limit"><code>normal_error_mean_deg &lt;= 5 deg</code></td>'
        '<td class="number">{}</td><td>{}</td></tr>'
    )
    assert '<tr class="out">' + row.format(6, "not met") in text
    assert "<tr>" + row.format(4, "met") in text
    assert "<h2>Claims</h2>" not in page()


def test_what_is_out_is_marked(scenario, make_log):
    def change(log):
        log.joint_velocity[5000, 3] = -4.35
        log.dimension[:] = 1

    log = make_log(scenario, change)
    text = render_report(log, compute_metrics(log, scenario), scenario)
    check(text)
    assert re.findall('<tr class="out"><td><code>(.*?)</code>', text) == [
        *("false_contact_share", "joint_speed_share_max", "limits_broken")
    ]
    assert "joint 4 speed 4.35 rad/s at 5 s (limit 2.175)" in text
    good = make_log(scenario)
    text = render_report(good, compute_metrics(good, scenario), scenario)
    assert 'class="out"' not in text
    assert "broke limits" not in text


def test_a_run_without_a_filter_has_a_page_without_its_pictures(scenario, make_log):
    log = make_log(scenario)
    of_filter = [c for c in log if c.startswith(("dimension", "force_direction"))]
    log = log.drop(columns=of_filter)
    text = render_report(log, compute_metrics(log, scenario), scenario)
    assert len(check(text)) == 5
    expected = [section for section in SECTIONS if section != "Contact direction"]
    assert re.findall("<h2>(.*?)</h2>", text) == expected
    assert 'class="out"' not in text


def test_equal_runs_give_equal_pages(page):
    assert page() == page()


@pytest.mark.parametrize("rows", [0, 1, 2, 3500])
def test_a_failed_run_is_shown_as_far_as_it_went(page, rows):
    text = page(rows, failure="it <broke>")
    check(text)
    assert "it &lt;broke&gt;" in text
    assert ("data:image/png" in text) == (rows > 1)


def test_text_from_the_scenario_is_escaped(scenario, make_log):
    scenario.description = "<script>alert(1)</script>"
    log = make_log(scenario)
    text = render_report(log, compute_metrics(log, scenario), scenario)
    check(text)
    assert "<script>" not in text


def test_values_that_are_not_finite_are_drawn_as_gaps(scenario, make_log):
    log = make_log(scenario).copy()
    log.iloc[5000:5100, :40] = np.nan
    log.loc[log.index[6000], "reference_force_x"] = np.inf
    check(render_report(log, compute_metrics(log, scenario), scenario))


def test_file_is_written_whole(scenario, make_log, tmp_path):
    log = make_log(scenario)
    path = tmp_path / "report.html"
    path.write_text("old")
    write_report(log, compute_metrics(log, scenario), scenario, path)
    assert path.read_text().endswith("</html>\n")
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "-"),
        (True, "yes"),
        (False, "no"),
        (7, "7"),
        (0.0123456, "0.01235"),
        (0.0, "0"),
        ([], "none"),
        (["torque", "joint_speed"], "torque, joint_speed"),
    ],
)
def test_format_metric(value, text):
    assert format_metric(value) == text
