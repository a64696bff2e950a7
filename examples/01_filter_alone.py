# SPDX-License-Identifier: BSD-3-Clause
"""The Force-Space Particle Filter alone: no Drake, no robot, a few made-up numbers.

    python examples/01_filter_alone.py [seconds]

A tool moves freely for a second, then is pushed against a slanted wall. The
filter finds out that it touches something, and in which direction.
"""

import sys

import numpy as np

import dual_proxy as dp

duration = float(sys.argv[1]) if len(sys.argv) > 1 else 3.0

normal = np.array([0.6, 0.0, -0.8])  # Into the wall, in the base frame.
command = np.array([5.0, 0.0, -9.0])  # N: where the controller pushes.
noise = np.random.default_rng(1)

params = dp.ForceSpaceParticleFilterParams(num_particles=1000)
particle_filter = dp.ForceSpaceParticleFilter(params, seed=0)

for i in range(round(duration / params.period)):
    time = i * params.period
    touching = time >= 1.0

    # Every force is what the robot exerts on its environment.
    sensed_force = noise.normal(0.0, 0.2, 3) + 8.0 * touching * normal
    # Without a contact the tool moves; with one it only slides along the wall.
    velocity = np.array([0.03, 0.02, -0.01])
    if touching:
        velocity -= (velocity @ normal) * normal
    # The controller pushes in motion space, and holds a force in force space.
    motion_force = particle_filter.motion_selection @ command
    contact_force = particle_filter.force_selection @ (8.0 * normal)

    particle_filter.update(sensed_force, velocity, motion_force, contact_force)

    if i % 3 == 0:
        line = f"{time:5.2f} s   dimension {particle_filter.dimension}"
        if particle_filter.dimension:
            found = particle_filter.singular_vectors[:, 0]
            error = np.degrees(np.arccos(np.clip(found @ normal, -1.0, 1.0)))
            line += f"   normal {np.round(found, 2)}, {error:.1f} deg off"
        print(line)
