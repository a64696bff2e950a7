# SPDX-License-Identifier: BSD-3-Clause
"""Numerical stability under stress: see docs/stability.md."""
