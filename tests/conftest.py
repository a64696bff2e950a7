# SPDX-License-Identifier: BSD-3-Clause
"""What tests of several folders have."""

import pytest
from free_port import free_port
from sdk_folder import build_sdk


@pytest.fixture
def port():
    return free_port()


@pytest.fixture(scope="session")
def sdk_folder(tmp_path_factory):
    """The stand-in for Force Dimension's SDK, in folders as the SDK has them."""
    return build_sdk(tmp_path_factory.mktemp("sdk"))
