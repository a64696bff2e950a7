# SPDX-License-Identifier: BSD-3-Clause
"""A side in a process of its own: its hardware, its loop, its link to the other."""
