# SPDX-License-Identifier: BSD-3-Clause
"""Sides as processes know no LeafSystems: `make test` runs their tests once."""

import os

if os.environ.get("DUAL_PROXY_FACES") == "python":
    collect_ignore_glob = ["test_*.py"]
