# SPDX-License-Identifier: BSD-3-Clause
"""Sides as processes know no LeafSystems: `make test` runs their tests once."""

import os

import pytest
from sdk_folder import build_sdk

if os.environ.get("DUAL_PROXY_FACES") == "python":
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture
def port():
    from rig import free_port

    return free_port()


@pytest.fixture(scope="session")
def sdk_folder(tmp_path_factory):
    return build_sdk(tmp_path_factory.mktemp("sdk"))
