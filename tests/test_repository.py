# SPDX-License-Identifier: BSD-3-Clause
"""What the repository says of itself is so."""

from __future__ import annotations

import re
import subprocess
from importlib import resources
from pathlib import Path

import pytest

import dual_proxy as dp

ROOT = Path(__file__).resolve().parents[1]


def test_installed_package_is_typed_and_has_its_data():
    package = resources.files("dual_proxy")
    for name in ("py.typed", "_core.pyi", "robots/panda/panda.urdf"):
        assert package.joinpath(name).is_file(), name
    scenarios = (ROOT / "examples" / "scenarios").glob("*.yaml")
    assert dp.list_scenarios() == sorted(path.stem for path in scenarios)


def test_all_public_names_exist():
    for name in dp.__all__:
        assert getattr(dp, name) is not None
    compiled = {name for name in dir(dp._core) if not name.startswith("_")}
    internal = {"AngularFilterMeans", "FilterMeans"}
    assert compiled - internal <= set(dp.__all__)


@pytest.mark.parametrize(
    "page",
    [
        "README.md",
        "docs/benchmarks.md",
        "docs/force_sensor.md",
        "docs/notes_on_the_paper.md",
        "docs/comparison.md",
        "docs/link.md",
        "docs/reproduction.md",
        "docs/use_from_cpp.md",
        "docs/omega.md",
    ],
)
def test_paths_in_documents_exist(page):
    text = (ROOT / page).read_text()
    links = re.findall(r"\]\((?!https?:)([^)#]+)", text)
    folders = "systems|plugin|bindings|examples|docs|benchmarks|tests"
    named = re.findall(rf"(?<![\w/])(?:{folders})/[\w./]*\w", text)
    assert links or named
    for path in [*links, *named]:
        assert ((ROOT / page).parent / path).exists() or (ROOT / path).exists(), path


def test_project_in_use_from_cpp_is_the_one_that_is_built():
    page = (ROOT / "docs" / "use_from_cpp.md").read_text()
    files = sorted((ROOT / "tests" / "consumer").iterdir())
    assert [path.name for path in files] == ["CMakeLists.txt", "diagram.cc", "main.cc"]
    for path in files:
        language = "cmake" if path.suffix == ".txt" else "cpp"
        assert f"`{path.name}`:\n\n```{language}\n{path.read_text()}```\n" in page


def test_no_source_file_lacks_its_license():
    files = subprocess.run(
        ["git", "ls-files", "*.py", "*.h", "*.cc"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    assert files
    for name in files:
        head = (ROOT / name).read_text()[:200]
        assert "SPDX-License-Identifier: BSD-3-Clause" in head, name


def test_nothing_compiled_is_tracked():
    listed = subprocess.run(
        ["git", "ls-files", "--eol"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    binary = [
        line.split("\t")[1]
        for line in listed.stdout.splitlines()
        if line.startswith("i/-text")
    ]
    allowed = ("docs/images/", "tests/fuzz/corpus/")
    assert all(name.startswith(allowed) for name in binary), binary
