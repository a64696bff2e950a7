# SPDX-License-Identifier: BSD-3-Clause
"""Faces of the force-space particle filter, its history, and its means."""

from __future__ import annotations

from dual_proxy import _core
from dual_proxy.systems._face import Face


class ForceSpaceParticleFilter(Face):
    """Finds the directions of contact, section IV of the paper.

    @ports

    Everything in the base frame B. Steps every `params.period`; the outputs are
    those of the last step, dimension 0 before the first. `WindowMean` makes the
    means. An angular filter is a second instance, fed with moments.

    Parameters
    ----------
    params : ForceSpaceParticleFilterParams.
    seed : of scatter and resampling.
    """

    def __init__(
        self,
        params: _core.ForceSpaceParticleFilterParams | None = None,
        seed: int = 0,
    ) -> None:
        params = _core.ForceSpaceParticleFilterParams() if params is None else params
        super().__init__(_core._make_ForceSpaceParticleFilter(params, seed))


class ContactHistory(Face):
    """Remembers what the filter believed where, and gives it as a prior.

    @ports

    Everything in the base frame B. Steps every `params.period`, which is the
    filter's; the output is that of the last step, so that history and filter
    can be wired in a ring. Section IV.C of the paper; dual_proxy.ContactHistory
    says what counts as a visit.

    Parameters
    ----------
    params : ContactHistoryParams.
    """

    def __init__(self, params: _core.ContactHistoryParams | None = None) -> None:
        super().__init__(
            _core._make_ContactHistory(
                _core.ContactHistoryParams() if params is None else params
            )
        )


class WindowMean(Face):
    """Mean of a 3-vector over the current window; what a slower system samples.

    @ports

    Steps every `period`; the mean is that of the last step, zero before the
    first. Windows are [k window, (k + 1) window): a system that runs every
    `window` sees the mean over the window that just ended. Samples that are not
    finite are left out.

    Parameters
    ----------
    window : s, in (0, 1e11].
    period : s, in (0, 1e11], between samples.
    """

    def __init__(self, window: float = 1 / 15, period: float = 0.001) -> None:
        super().__init__(_core._make_WindowMean(window, period))
