# SPDX-License-Identifier: BSD-3-Clause
"""Faces of the Force-Space Particle Filter and of what it takes: means and a
prior."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np

from dual_proxy import _core
from dual_proxy.systems._face import (
    Context,
    Face,
    Stepped,
    check_positive,
    matrix,
    pose,
    typed,
    vector,
)


class ForceSpaceParticleFilter(Face):
    """Finds the directions of contact: Algorithms 1 to 3.

    @system
    name: ForceSpaceParticleFilter
    input_ports:
    - sensed_force      # 3, N: F_s, mean over the last period
    - velocity          # 3, m/s: of E, likewise
    - motion_force      # 3, N: F_m, likewise
    - contact_force     # 3, N: F_f, likewise
    - prior             # array (3, k), expected normals, k <= 8 (optional)
    output_ports:
    - force_selection   # 9, row-major 3x3: Omega_f
    - dimension         # 1: 0..3
    - particles         # 3 n_p, particle after particle
    - force_direction   # 3: U1, the main direction; zero at dimension 0
    - direction_uncertainty  # 1, rad: holds the true direction with 95 %
    - dimension_confidence   # 1: probability that the dimension is right
    - counters          # 2: updates refused, updates in which nothing was likely
    @endsystem

    Everything in the base frame B. Steps every `params.period`; the outputs are
    those of the last step, dimension 0 before the first. WindowMean makes the
    means. A prior that is not as it should be leaves the one before in force.
    An angular filter is a second instance, fed with moments.

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
        super().__init__(feedthrough=False)
        self._filter = _core.ForceSpaceParticleFilterAlgorithm(
            deepcopy(params or _core.ForceSpaceParticleFilterParams())
        )
        self._native_arguments = {"params": self._filter.params, "seed": seed}
        self._inputs_3 = [
            self.DeclareVectorInputPort(name, 3)
            for name in ("sensed_force", "velocity", "motion_force", "contact_force")
        ]
        self._prior = self._declare_object_input("prior", np.zeros((3, 0)))
        params = self._filter.params
        self._declare_memory(self._filter.make_state(seed), params.period)
        self._declare_vector_output(
            "force_selection", 9, lambda state: state.force_selection
        )
        self._declare_vector_output("dimension", 1, lambda state: state.dimension)
        self._declare_vector_output(
            "particles",
            3 * params.num_particles,
            lambda state: np.asarray(state.particles).ravel(order="F"),
        )
        self._declare_vector_output(
            "force_direction",
            3,
            lambda state: state.singular_vectors[:, 0] * (state.dimension > 0),
        )
        self._declare_vector_output(
            "direction_uncertainty", 1, lambda state: state.direction_uncertainty
        )
        self._declare_vector_output(
            "dimension_confidence", 1, lambda state: state.dimension_confidence
        )
        self._declare_vector_output(
            "counters", 2, lambda state: (state.bad_inputs, state.all_weights_zero)
        )

    def _step(self, context: Context, state: Any) -> None:
        if self._prior.HasValue(context):
            self._filter.offer_prior(typed(self._prior, context, np.ndarray), state)
        F_s, v, F_m, F_f = (vector(port, context) for port in self._inputs_3)
        self._filter.update(F_s, v, F_m, F_f, state)


class ContactHistory(Face):
    """Remembers what the filter believed where, and gives it as a prior.

    @system
    name: ContactHistory
    input_ports:
    - robot_pose        # RigidTransform X_BE
    - force_selection   # 9, row-major 3x3: Omega_f of the filter (optional)
    - force_direction   # 3: U1 of the filter (optional)
    output_ports:
    - prior             # array (3, k), k <= 8: unit normals, into the surface,
                        # believed here on earlier visits; to the filter's prior
    @endsystem

    Everything in the base frame B. Without `force_direction` it notes nothing,
    without `force_selection` that one direction. Steps every `params.period`,
    which is the filter's; the output is that of the last step, k = 0 before the
    first, without feedthrough, so that history and filter can be wired in a
    ring. Section IV.C of the paper; dual_proxy.ContactHistory says what counts
    as a visit.

    Parameters
    ----------
    params : ContactHistoryParams.
    """

    def __init__(self, params: _core.ContactHistoryParams | None = None) -> None:
        super().__init__(feedthrough=False)
        self._history = _core.ContactHistory(
            deepcopy(params or _core.ContactHistoryParams())
        )
        self._native_arguments = {"params": self._history.params}
        self._pose = self._declare_pose_input("robot_pose")
        self._selection = self.DeclareVectorInputPort("force_selection", 9)
        self._direction = self.DeclareVectorInputPort("force_direction", 3)
        nothing = np.zeros((3, 0))
        self._declare_memory(
            Stepped(self._history.make_state(), nothing), self._history.params.period
        )
        self._declare_object_output("prior", nothing, lambda state: state.output)

    def _step(self, context: Context, state: Stepped) -> None:
        p_BE, _R_BE = pose(self._pose, context)
        self._history.update_from_selection(
            p_BE,
            matrix(self._selection, context),
            vector(self._direction, context),
            state.state,
        )
        state.output, _std = self._history.lookup(p_BE, state.state)


class WindowMean(Face):
    """Mean of a 3-vector over the current window; what a slower system samples.

    @system
    name: WindowMean
    input_ports:
    - value   # 3
    output_ports:
    - mean    # 3
    @endsystem

    Steps every `period`; the mean is that of the last step, zero before the
    first. Windows are [k window, (k + 1) window): a system that runs every
    `window` sees the mean over the window that just ended. Samples that are not
    finite are left out.

    Parameters
    ----------
    window : s, > 0.
    period : s, > 0, between samples.
    """

    def __init__(self, window: float = 1 / 15, period: float = 0.001) -> None:
        super().__init__(feedthrough=False)
        check_positive("WindowMean", "period", period)
        self._mean = _core.WindowMean(window)
        self._native_arguments = {"window": window, "period": period}
        self._value = self.DeclareVectorInputPort("value", 3)
        self._declare_memory(self._mean.make_state(), period)
        self._declare_vector_output("mean", 3, lambda state: state.mean)

    def _step(self, context: Context, state: Any) -> None:
        self._mean.update(context.get_time(), self._value.Eval(context), state)
