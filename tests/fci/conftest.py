# SPDX-License-Identifier: BSD-3-Clause
"""Sides as processes know no LeafSystems: `make test` runs their tests once."""

import os

import pytest
from fci_rig import FciRig, need_simulator

if os.environ.get("DUAL_PROXY_FACES") == "python":
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture
def rig(tmp_path):
    need_simulator()
    rig = FciRig(tmp_path)
    yield rig
    rig.end()
