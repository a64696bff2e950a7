# SPDX-License-Identifier: BSD-3-Clause
"""Benchmarks of the command `dual-proxy bench`: run time against error."""
