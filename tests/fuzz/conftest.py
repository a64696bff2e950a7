# SPDX-License-Identifier: BSD-3-Clause
"""How many examples of everything: few and always the same, or more and others."""

import os

from hypothesis import HealthCheck, settings

EXAMPLES = os.environ.get("DUAL_PROXY_FUZZ_EXAMPLES")

settings.register_profile(
    "dual_proxy",
    max_examples=int(EXAMPLES or 30),
    derandomize=EXAMPLES is None,
    database=None,
    deadline=None,
    print_blob=False,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
settings.load_profile("dual_proxy")

# Nothing here depends on what the LeafSystems are written in: `make test` runs it
# once.
if os.environ.get("DUAL_PROXY_FACES") == "python":
    collect_ignore_glob = ["test_*.py"]
