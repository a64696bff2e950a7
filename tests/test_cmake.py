# SPDX-License-Identifier: BSD-3-Clause
"""How CMake finds Drake, and what find_package(dual_proxy) answers.

Each test configures a project of a few lines, without a compiler; Drake and
pydrake are folders with as little in them as their search looks at.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

FIND_DRAKE = f"""
include({ROOT}/cmake/FindPipPackages.cmake)
include({ROOT}/cmake/FindDrakeLibrary.cmake)
foreach(name DRAKE DRAKE_VERSION NO_DRAKE BAD_DRAKE)
  message(NOTICE "${{name}}: ${{DUAL_PROXY_${{name}}}}")
endforeach()
if(TARGET drake::drake)
  get_target_property(library drake::drake IMPORTED_LOCATION)
  message(NOTICE "library: ${{library}}")
endif()
"""


def write(path: Path, text: str = "") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


# The tools of the environment that runs the tests go first.
PATH = f"{Path(sys.executable).parent}:{os.environ['PATH']}"


def cmake(*arguments: object, **environment: str) -> str:
    """Returns what CMake prints on standard error: notices and errors."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("CMAKE", "DRAKE", "PYTHONPATH"))
    }
    run = subprocess.run(
        [shutil.which("cmake", path=PATH), *arguments],
        env={**kept, "PATH": PATH, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    # CMake breaks its errors into lines of its own.
    return " ".join(run.stderr.split())


class Project:
    """A CMake project in a folder of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.environment: dict[str, str] = {}
        self.write(FIND_DRAKE)

    def write(self, text: str) -> None:
        start = "cmake_minimum_required(VERSION 3.25)\nproject(p LANGUAGES NONE)\n"
        write(self.folder / "CMakeLists.txt", start + text)

    def configure(self, **settings: object) -> str:
        settings = {"Python_EXECUTABLE": sys.executable, **settings}
        return cmake(
            *("-G", "Ninja", "-S", self.folder, "-B", self.folder / "build"),
            *(f"-D{name}={value}" for name, value in settings.items()),
            **self.environment,
        )


@pytest.fixture
def project(tmp_path):
    """Looks for Drake; a package `pydrake` 1.51.1 and fmt can be found."""
    project = Project(tmp_path / "project")
    pydrake = tmp_path / "python" / "pydrake"
    write(pydrake / "__init__.py")
    write(pydrake / "lib" / "libdrake.so")
    write(pydrake / "doc" / "drake" / "VERSION.TXT", "1.51.1 778ac9e\n")
    project.environment["PYTHONPATH"] = str(pydrake.parent)
    write(tmp_path / "fmt" / "fmt-config.cmake")
    project.environment["fmt_ROOT"] = str(tmp_path / "fmt")
    return project


@pytest.fixture
def headers(tmp_path):
    folder = tmp_path / "headers"
    write(folder / "drake" / "systems" / "framework" / "leaf_system.h")
    write(folder / "drake" / "common" / "autodiff_config.h")
    return folder


def test_wheel_alone_says_what_to_give(project):
    output = project.configure()
    assert "NO_DRAKE: the pydrake wheel has a library but no headers" in output
    assert "-DDRAKE_INCLUDE_DIR=<folder that has drake/, version 1.51.1>" in output
    assert "BAD_DRAKE: FALSE" in output
    assert "library" not in output.split("BAD_DRAKE")[1]


def test_real_wheel_is_seen(project):
    del project.environment["PYTHONPATH"]
    pytest.importorskip("pydrake")
    assert "the pydrake wheel has a library" in project.configure()


def test_neither_wheel_nor_drake(project):
    (Path(project.environment["PYTHONPATH"]) / "pydrake/lib/libdrake.so").unlink()
    output = project.configure()
    assert "NO_DRAKE: found neither an installed Drake" in output
    assert "BAD_DRAKE: FALSE" in output


def test_wheel_with_headers(project, headers):
    output = project.configure(DRAKE_INCLUDE_DIR=headers)
    assert "DRAKE: 1.51.1, the pydrake wheel's library" in output
    assert f"headers (version unknown) in {headers}" in output
    assert "DRAKE_VERSION: 1.51.1" in output
    assert f"library: {project.environment['PYTHONPATH']}/pydrake/lib" in output


def test_version_is_that_of_the_wheel(project, headers):
    pydrake = Path(project.environment["PYTHONPATH"]) / "pydrake"
    write(pydrake / "doc" / "drake" / "VERSION.TXT", "1.58.0 0000000\n")
    write(headers / "VERSION.TXT", "1.58.0 0000000\n")
    output = project.configure(DRAKE_INCLUDE_DIR=headers)
    assert "DRAKE: 1.58.0, the pydrake wheel's library" in output
    write(headers / "VERSION.TXT", "1.51.1 778ac9e\n")
    output = project.configure(DRAKE_INCLUDE_DIR=headers)
    assert (
        "expected headers of Drake 1.58.0, as the pydrake wheel, got 1.51.1" in output
    )


def test_environment_variable_counts_and_may_change(project, headers, tmp_path):
    project.configure()
    project.environment["DRAKE_INCLUDE_DIR"] = str(headers)
    assert f"in {headers}" in project.configure()
    other = shutil.copytree(headers, tmp_path / "other")
    project.environment["DRAKE_INCLUDE_DIR"] = str(other)
    assert f"in {other}" in project.configure()
    # A build that configures itself again keeps it.
    del project.environment["DRAKE_INCLUDE_DIR"]
    assert f"in {other}" in project.configure()
    # What is given goes before the environment.
    project.environment["DRAKE_INCLUDE_DIR"] = str(other)
    assert f"in {headers}" in project.configure(DRAKE_INCLUDE_DIR=headers)


@pytest.fixture
def check_headers(headers, tmp_path):
    """Says which version the headers are, and why not to use them with 1.51.1."""
    headers = headers.rename(tmp_path / "include")
    script = write(
        tmp_path / "check.cmake",
        f"""
include({ROOT}/cmake/FindDrakeLibrary.cmake)
dual_proxy_check_drake_headers({headers} 1.51.1 version wrong)
message(NOTICE "version: [${{version}}] wrong: [${{wrong}}]")
""",
    )

    def check() -> str:
        return cmake("-P", script)

    check.headers = headers
    return check


@pytest.mark.parametrize(
    ("file", "text", "version"),
    [
        ("../share/doc/drake/VERSION.TXT", "1.51.1 778ac9e\n", "1.51.1"),
        ("drake/VERSION.TXT", "1.51.1 778ac9e\n", "1.51.1"),
        ("VERSION.TXT", "1.51.1\n", "1.51.1"),
        ("drake/doc/_release-notes/v1.51.0.md", "", "1.51"),
    ],
)
def test_version_of_headers_is_read(check_headers, file, text, version):
    write(check_headers.headers / file, text)
    write(check_headers.headers / "drake/doc/_release-notes/v1.9.0.md")
    assert check_headers() == f"version: [{version}] wrong: []"


@pytest.mark.parametrize(
    ("file", "text", "version"),
    [
        ("../share/doc/drake/VERSION.TXT", "1.50.0 0000000\n", "1.50.0"),
        ("drake/VERSION.TXT", "1.51.10 0000000\n", "1.51.10"),
        ("VERSION.TXT", "1.5\n", "1.5"),
        ("drake/doc/_release-notes/v1.52.0.md", "", "1.52"),
    ],
)
def test_headers_of_another_version_are_refused(check_headers, file, text, version):
    write(check_headers.headers / file, text)
    write(check_headers.headers / "drake/doc/_release-notes/v1.51.0.md")
    assert check_headers() == (
        "version: [] wrong: [DRAKE_INCLUDE_DIR: expected headers of Drake 1.51.1, "
        f"as the pydrake wheel, got {version} in {check_headers.headers}]"
    )


def test_version_of_a_checkout(check_headers):
    def git(*arguments: str) -> None:
        identity = ["-c", "user.name=t", "-c", "user.email=t@example.com"]
        folder = check_headers.headers / "drake"
        subprocess.run(
            ["git", *identity, "-C", folder, *arguments],
            check=True,
            capture_output=True,
        )

    git("init")
    git("commit", "--allow-empty", "-m", "release")
    git("tag", "v1.51.1")
    assert check_headers() == "version: [1.51.1] wrong: []"
    git("commit", "--allow-empty", "-m", "later")
    assert "got 1.51.1-1-g" in check_headers()


@pytest.mark.parametrize(
    ("missing", "message"),
    [
        ("systems/framework/leaf_system.h", "expected a folder with drake/systems/"),
        ("common/autodiff_config.h", "is missing; Drake's build generates it"),
    ],
)
def test_missing_headers_are_named(check_headers, missing, message):
    (check_headers.headers / "drake" / missing).unlink()
    output = check_headers()
    assert f"drake/{missing}" in output
    assert message in output


def test_headers_that_do_not_fit_are_an_error(project, headers):
    write(headers / "VERSION.TXT", "1.50.0")
    output = project.configure(DRAKE_INCLUDE_DIR=headers)
    assert "NO_DRAKE: DRAKE_INCLUDE_DIR: expected headers of Drake 1.51.1" in output
    assert "BAD_DRAKE: TRUE" in output
    assert "library" not in output.split("BAD_DRAKE")[1]


def test_missing_fmt_is_named(project, headers):
    output = project.configure(
        DRAKE_INCLUDE_DIR=headers, CMAKE_DISABLE_FIND_PACKAGE_fmt=True
    )
    assert "NO_DRAKE: Drake's headers need fmt" in output
    assert "(Debian: libfmt-dev)" in output
    assert "BAD_DRAKE: TRUE" in output


def test_installed_drake_goes_first(project, headers, tmp_path):
    package = tmp_path / "opt" / "lib" / "cmake" / "drake"
    write(
        package / "drake-config.cmake",
        "add_library(drake::drake SHARED IMPORTED)\n"
        "set_target_properties(drake::drake PROPERTIES IMPORTED_LOCATION /opt/d.so)\n",
    )
    write(package / "drake-config-version.cmake", "set(PACKAGE_VERSION 1.52.0)\n")
    output = project.configure(
        CMAKE_PREFIX_PATH=tmp_path / "opt", DRAKE_INCLUDE_DIR=headers
    )
    assert f"DRAKE: 1.52.0, installed in {package}" in output
    assert "DRAKE_VERSION: 1.52.0" in output
    assert "library: /opt/d.so" in output


def test_installed_drake_that_cannot_be_used_is_an_error(project, headers, tmp_path):
    package = tmp_path / "opt" / "lib" / "cmake" / "drake"
    write(
        package / "drake-config.cmake",
        'set(drake_FOUND FALSE)\nset(drake_NOT_FOUND_MESSAGE "no spdlog")\n',
    )
    output = project.configure(
        CMAKE_PREFIX_PATH=tmp_path / "opt", DRAKE_INCLUDE_DIR=headers
    )
    assert f"NO_DRAKE: {package}/drake-config.cmake cannot be used: no spdlog" in output
    assert "BAD_DRAKE: TRUE" in output


class TestFindPackage:
    """find_package(dual_proxy), of a package with stand-ins for the libraries."""

    @pytest.fixture
    def prefix(self, tmp_path):
        """The package, but for its configuration, and what it depends on."""
        cmake = tmp_path / "prefix" / "lib" / "cmake"
        for name in ("FindPipPackages.cmake", "FindDrakeLibrary.cmake"):
            write(cmake / "dual_proxy" / name, (ROOT / "cmake" / name).read_text())
        for library in ("dual_proxy", "dual_proxy_drake"):
            write(
                cmake / "dual_proxy" / f"{library}Targets.cmake",
                f"add_library(dual_proxy::{library} INTERFACE IMPORTED)\n",
            )
        for name in ("Eigen3", "ruckig"):
            write(cmake / name / f"{name}Config.cmake")
            write(
                cmake / name / f"{name}ConfigVersion.cmake",
                "set(PACKAGE_VERSION 3.4.0)\nset(PACKAGE_VERSION_COMPATIBLE TRUE)\n",
            )
        return tmp_path / "prefix"

    @pytest.fixture
    def ask(self, project, prefix):
        """Asks for the package, as built with a Drake, with find_package()."""

        def ask(request: str, *, built_with: str, **settings: object) -> str:
            project.write(
                f"""
include(CMakePackageConfigHelpers)
set(DUAL_PROXY_DRAKE_VERSION {built_with})
configure_package_config_file(
  {ROOT}/cmake/dual_proxyConfig.cmake.in
  {prefix}/lib/cmake/dual_proxy/dual_proxyConfig.cmake
  INSTALL_DESTINATION lib/cmake/dual_proxy INSTALL_PREFIX {prefix})
unset(DUAL_PROXY_DRAKE_VERSION)

set(before "")
get_cmake_property(before VARIABLES)
find_package(dual_proxy {request})
get_cmake_property(after VARIABLES)
list(REMOVE_ITEM after ${{before}})
message(NOTICE "new: ${{after}}")
message(NOTICE "found: ${{dual_proxy_FOUND}}")
message(NOTICE "why: ${{dual_proxy_NOT_FOUND_MESSAGE}}")
foreach(name dual_proxy dual_proxy_drake)
  if(TARGET dual_proxy::${{name}})
    message(NOTICE "target ${{name}}")
  endif()
endforeach()
"""
            )
            return project.configure(CMAKE_PREFIX_PATH=prefix, **settings)

        return ask

    def test_algorithms_need_no_drake(self, ask):
        output = ask("REQUIRED", built_with="1.51.1")
        assert "found: 1" in output
        assert output.endswith("target dual_proxy")

    def test_only_targets_get_into_the_project(self, ask, headers):
        output = ask(
            "REQUIRED COMPONENTS drake", built_with="1.51.1", DRAKE_INCLUDE_DIR=headers
        )
        assert output.endswith("target dual_proxy target dual_proxy_drake")
        variables = output.split("new: ")[1].split()[0].split(";")
        assert "dual_proxy_FOUND" in variables
        # What CMake itself sets or caches, and what a user may set.
        allowed = r"dual_proxy_|PACKAGE_|FIND_PACKAGE_|_Python_|.+_DIR$"
        assert [v for v in variables if not re.match(allowed, v)] == []
        assert "dual_proxy_missing" not in variables

    @pytest.mark.parametrize(
        ("built_with", "component", "why"),
        [
            ("", "drake", "component drake: this dual_proxy was built without Drake"),
            ("1.51.1", "drake", "component drake: the pydrake wheel has a library"),
            ("1.51.1", "station", "component station: unknown, there is only `drake`"),
        ],
    )
    def test_missing_component(self, ask, built_with, component, why):
        output = ask(f"COMPONENTS {component}", built_with=built_with)
        assert "found: 0" in output
        assert f"why: {why}" in output
        assert "target dual_proxy_drake" not in output

    def test_missing_optional_component(self, ask):
        output = ask("REQUIRED OPTIONAL_COMPONENTS drake", built_with="")
        assert "found: 1" in output
        assert output.endswith("target dual_proxy")

    def test_another_drake_than_it_was_built_with(self, ask, headers):
        output = ask("COMPONENTS drake", built_with="1.50.0", DRAKE_INCLUDE_DIR=headers)
        assert "found: 0" in output
        assert "expected Drake 1.50.0" in output
        assert "got 1.51.1, the pydrake wheel" in output

    def test_missing_dependency_is_named(self, ask):
        output = ask("", built_with="", CMAKE_DISABLE_FIND_PACKAGE_ruckig=True)
        assert "found: 0" in output
        assert "why: ruckig was found neither in CMAKE_PREFIX_PATH" in output


@pytest.mark.parametrize(
    ("flag", "message"),
    [
        ("-D_GLIBCXX_DEBUG", "Drake is built without _GLIBCXX_DEBUG"),
        ("-D_GLIBCXX_USE_CXX11_ABI=0", "Drake is built with _GLIBCXX_USE_CXX11_ABI=1"),
        ("-D__AVX__", "Drake is built without AVX"),
        ("-DNDEBUG", ""),
    ],
)
def test_flags_that_do_not_go_with_drake_are_refused(flag, message):
    header = ROOT / "systems" / "faces" / "drake_binary.h"
    command = ["c++", "-std=c++20", "-x", "c++", "-E", flag, header]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (run.returncode == 0) == (message == "")
    assert message in run.stderr
