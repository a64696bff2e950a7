# SPDX-License-Identifier: BSD-3-Clause
"""A UDP port for a link of this machine."""

import socket


def free_port():
    """Return one that nothing uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]
