# SPDX-License-Identifier: BSD-3-Clause
"""The force-space particle filter against an independent NumPy implementation."""

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import dual_proxy as dp

MASK = (1 << 64) - 1
ZERO = np.zeros(3)
DOWN = np.array([0.0, 0.0, -1.0])
SIDE = np.array([0.0, 1.0, 0.0])
# The printed filter, of which most of these tests are.
PAPER = dp.ForceSpaceParticleFilterParams(likelihood="paper")
RECORDINGS = sorted(
    (Path(__file__).resolve().parents[3] / "shared" / "data").glob("panda_*.csv")
)


def splitmix(state):
    """The next state, and the number that belongs to it."""
    state = (state + 0x9E3779B97F4A7C15) & MASK
    z = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return state, z ^ (z >> 31)


def split_seed(seed, stream):
    return splitmix((splitmix(seed)[1] + stream) & MASK)[1]


class Xoshiro:
    """xoshiro256++, one or several side by side; `words` are of their states."""

    def __init__(self, words):
        self.s = np.array(words, dtype=np.uint64).reshape(4, -1)

    @staticmethod
    def rotated(x, bits):
        return (x << np.uint64(bits)) | (x >> np.uint64(64 - bits))

    def next(self):
        s = self.s
        result = self.rotated(s[0] + s[3], 23) + s[0]
        t = s[1] << np.uint64(17)
        s[2] ^= s[0]
        s[3] ^= s[1]
        s[1] ^= s[2]
        s[0] ^= s[3]
        s[2] ^= t
        s[3] = self.rotated(s[3], 45)
        return result


class Random:
    """The filter's random numbers: a uniform per update, and a block's normals."""

    def __init__(self, seed):
        words = []
        state = seed
        for _ in range(4):
            state, word = splitmix(state)
            words.append(word)
        self.one = Xoshiro(words)
        self.eight = Xoshiro([split_seed(seed, i) for i in range(32)])

    def uniform(self):
        """With the 32 bits that the resampling looks at."""
        return float(self.one.next()[0] >> np.uint64(32)) * 2.0**-32

    def sixteen_normals(self):
        a, b = self.eight.next(), self.eight.next()
        u = 1 - (a >> np.uint64(12)) * 2.0**-52
        angle = np.pi / 2 * ((b >> np.uint64(12)) * 2.0**-52 - 0.5)
        radius = np.sqrt(-2 * np.log(u)) * np.where(b & np.uint64(2), -1, 1)
        pair = radius * np.array([np.cos(angle), np.sin(angle)])
        return np.where(b & np.uint64(1), pair[::-1], pair).ravel()

    def scatter(self, n):
        """(n, 3): of up to 256 particles the x, the y, the z, in whole groups."""
        blocks = []
        for size in [256] * (n // 256) + [n % 256] * (n % 256 > 0):
            groups = -(-size // 16)
            block = [self.sixteen_normals() for _ in range(3 * groups)]
            blocks.append(np.reshape(block, (3, -1))[:, :size].T)
        return np.concatenate(blocks)


class PrintedFilter:
    """Algorithms 1 to 3 as the paper prints them, with lists and a real SVD.

    What is mended is what cannot run as printed: the clamp of the dimension,
    the direction of the comparison in Algorithm 2, and all weights zero.
    """

    def __init__(self, params, seed):
        self.params = params
        self.random = Random(seed)
        self.particles = [ZERO] * params.num_particles
        self.dimension = 0

    def weight(self, rho, force, velocity, t):
        on_sphere = np.linalg.norm(rho) > self.params.epsilon
        pushing = rho @ force if on_sphere else np.linalg.norm(force)
        w_f = np.clip((pushing - t.force_low) / (t.force_high - t.force_low), 0, 1)
        if not on_sphere:
            return (1 - w_f) * 0.5
        excess = (abs(rho @ velocity) - t.velocity_low) / (
            t.velocity_high - t.velocity_low
        )
        return w_f * np.clip(1 - excess, 0, 1)

    def direction(self, vector):
        norm = np.linalg.norm(vector)
        return vector / norm if norm > self.params.epsilon else ZERO

    def update(self, force, velocity, motion_force, contact_force):
        p = self.params
        augmented = []
        on_sphere = np.linalg.norm(self.particles, axis=1) > p.epsilon
        if on_sphere.any():
            noise = self.random.scatter(p.num_particles)
            d = p.scatter_mean + p.scatter_std * noise
            augmented += [*(self.particles + d * on_sphere[:, None])]
        else:
            augmented += self.particles
        if np.linalg.norm(motion_force) > p.epsilon:
            tentative = self.direction(motion_force)
            u_f = self.direction(contact_force)
            share = self.weight(tentative, force, velocity, p.update_thresholds)
            n_add = int(np.floor(share * p.num_particles + 0.5))
            for i in range(1, n_add + 1):
                s = (i - 0.5) / n_add
                augmented.append(s * u_f + (1 - s) * tentative)
        augmented.append(ZERO)
        augmented = [self.direction(rho) for rho in augmented]

        n = p.num_particles
        weights = np.array(
            [
                self.weight(rho, force, velocity, p.resampling_thresholds)
                for rho in augmented
            ]
        )
        r = self.random.uniform() / n
        if weights.sum() > 0:
            cumulative = np.cumsum(weights) / weights.sum()
            chosen = np.searchsorted(cumulative, r + np.arange(n) / n, side="right")
            self.particles = [augmented[i] for i in chosen]
        else:
            self.particles = [*augmented[: n - 1], ZERO]
        return self.spaces(np.array(self.particles).T)

    def spaces(self, particles):
        p = self.params
        n = particles.shape[1]
        X = np.zeros((3, n + n // 2))
        X[:, :n] = particles
        U, S, _ = np.linalg.svd(X, full_matrices=False)
        if np.linalg.norm(S) < np.sqrt(n / 2):
            self.dimension = 0
            return S, np.zeros((3, 3))
        lower = 1 + (S[1:] > p.alpha_add * S[0]).sum()
        upper = 3 - (S[1:] < p.alpha_remove * S[0]).sum()
        self.dimension = int(np.clip(self.dimension, lower, upper))
        if self.dimension == 1:
            return S, np.outer(U[:, 0], U[:, 0])
        if self.dimension == 2:
            return S, np.eye(3) - np.outer(U[:, 2], U[:, 2])
        return S, np.eye(3)


def tour():
    """Inputs of a tour: free, a wall, turning with friction, a corner, a slip."""
    rng = np.random.default_rng(7)
    for i in range(75):
        contact = ZERO
        velocity = np.array([0.05, 0, 0])
        if i < 5:
            force, motion = ZERO, 2 * DOWN
        elif i < 10:
            force, motion, velocity = 8 * DOWN, 8 * DOWN, ZERO
        elif i < 35:
            angle = 0.03 * (i - 10)
            normal = np.array([0, np.sin(angle), -np.cos(angle)])
            force = 8 * normal + np.array([1.5, 0, 0])
            motion, contact = np.array([1.0, 0, 0]), 8 * normal
        elif i < 55:
            force = 8 * DOWN + 7 * SIDE
            motion, contact, velocity = 7 * SIDE, 8 * DOWN, ZERO
        elif i < 58:
            force, motion = -9 * (DOWN + SIDE), ZERO  # nothing is likely
        else:
            force, motion = (70 - i) * SIDE * (i < 70), ZERO
        yield force + 0.2 * rng.normal(size=3), velocity, motion, contact


def test_agrees_with_the_printed_algorithms():
    # Rounding differs, in the eigenproblem and in sines and logarithms; no
    # particle of this tour is so close to a limit that it matters.
    params = dp.ForceSpaceParticleFilterParams(num_particles=300, likelihood="paper")
    dut = dp.ForceSpaceParticleFilter(params, seed=12)
    expected = PrintedFilter(params, seed=12)
    seen = set()
    statuses = set()
    for inputs in tour():
        statuses.add(dut.update(*inputs))
        S, Omega_f = expected.update(*inputs)
        np.testing.assert_allclose(
            dut.particles, np.array(expected.particles).T, rtol=0, atol=1e-12
        )
        # Small ones as roots of eigenvalues: half of the digits of the largest.
        np.testing.assert_allclose(dut.singular_values, S, atol=1e-7 * (1 + S[0]))
        assert dut.dimension == expected.dimension
        np.testing.assert_allclose(dut.force_selection, Omega_f, atol=1e-9)
        np.testing.assert_allclose(dut.motion_selection, np.eye(3) - Omega_f, atol=1e-9)
        seen.add(dut.dimension)
    assert seen >= {0, 1, 2}
    assert statuses == {"ok", "all_weights_zero"}
    assert dut.updates == 75


def test_agrees_with_an_svd_for_random_particles():
    # Strong scatter and free limits: singular values of all kinds.
    params = dp.ForceSpaceParticleFilterParams(
        num_particles=100,
        likelihood="paper",
        scatter_std=0.3,
        alpha_add=0.4,
        alpha_remove=0.2,
    )
    rng = np.random.default_rng(3)
    dut = dp.ForceSpaceParticleFilter(params, seed=0)
    expected = PrintedFilter(params, seed=0)
    seen = set()
    for _ in range(500):
        force, motion, contact = 6 * rng.normal(size=(3, 3))
        dut.update(force, 0.003 * rng.normal(size=3), motion, contact)
        S, Omega_f = expected.spaces(dut.particles)
        np.testing.assert_allclose(dut.singular_values, S, atol=1e-6)
        assert dut.dimension == expected.dimension
        np.testing.assert_allclose(dut.force_selection, Omega_f, atol=1e-8)
        U, S = dut.singular_vectors, dut.singular_values
        np.testing.assert_allclose(
            U @ np.diag(S**2) @ U.T, dut.particles @ dut.particles.T, atol=1e-10
        )
        seen.add(dut.dimension)
    assert seen == {0, 1, 2, 3}


@pytest.mark.parametrize("index", range(4))
def test_recorded_hand_guiding(index):
    """Real contact with friction and noise.

    A person guides the arm, so there is no command: the sensed force's direction
    stands in for it.
    """
    if index >= len(RECORDINGS):
        pytest.skip("the recorded data (../shared/data) is not on this machine")
    data = np.genfromtxt(RECORDINGS[index], delimiter=",", names=True)
    R = np.stack([data[f"R{i}{j}"] for i in "123" for j in "123"], -1)
    force = np.einsum(
        "nij,nj->ni",
        R.reshape(-1, 3, 3),
        np.stack([data[f"sensed_f{axis}"] for axis in "xyz"], -1),
    )
    velocity = np.stack([data[f"v{axis}"] for axis in "xyz"], -1)

    dut = dp.ForceSpaceParticleFilter(PAPER, seed=0)
    expected = PrintedFilter(dut.params, seed=0)
    edges = np.round(np.arange(0, len(data) / 100, dut.params.period) * 100)
    angles = []
    dimensions = set()
    for start, end in zip(edges[:-1].astype(int), edges[1:].astype(int), strict=True):
        mean_force = force[start:end].mean(axis=0)
        command = mean_force / np.linalg.norm(mean_force)
        status = dut.update(
            mean_force,
            velocity[start:end].mean(axis=0),
            dut.motion_selection @ command,
            dut.force_selection @ command,
        )
        assert status in ("ok", "all_weights_zero")
        S, Omega_f = expected.spaces(dut.particles)
        assert dut.dimension == expected.dimension
        np.testing.assert_allclose(dut.singular_values, S, atol=1e-5)
        np.testing.assert_allclose(dut.force_selection, Omega_f, atol=1e-7)
        dimensions.add(dut.dimension)
        if dut.dimension == 1 and np.linalg.norm(mean_force) > 3:
            angles.append(np.degrees(np.arccos(-dut.singular_vectors[2, 0])))
    assert dimensions >= {0, 1}
    if RECORDINGS[index].stem == "panda_guided_03":
        # Mostly pressing and sliding on the board, whose normal is -z.
        assert np.median(angles) < 10


def test_one_wall_then_free():
    dut = dp.ForceSpaceParticleFilter(PAPER, seed=1)
    assert dut.dimension == 0
    assert dut.particles.shape == (3, 1000)
    for _ in range(2):
        assert dut.update(8 * DOWN, ZERO, 8 * DOWN, ZERO) == "ok"
    for _ in range(10):
        dut.update(8 * DOWN, [0.05, 0, 0], ZERO, 8 * DOWN)
    assert dut.dimension == 1
    angle = np.degrees(np.arccos(dut.singular_vectors[:, 0] @ DOWN))
    assert angle < 5
    for _ in range(5):
        dut.update(ZERO, ZERO, ZERO, ZERO)
    assert dut.dimension == 0


def test_turns_with_its_inputs():
    for seed in range(5):
        R = Rotation.random(rng=seed).as_matrix()
        dut = dp.ForceSpaceParticleFilter(PAPER, seed=seed)
        for _ in range(5):
            dut.update(R @ (8 * DOWN), ZERO, R @ DOWN, ZERO)
        assert dut.singular_vectors[:, 0] @ (R @ DOWN) > np.cos(np.radians(5))


def test_bad_input_changes_nothing_but_its_count():
    dut = dp.ForceSpaceParticleFilter(PAPER, seed=1)
    dut.update(8 * DOWN, ZERO, DOWN, ZERO)
    before = dut.particles
    for argument in range(4):
        inputs = [8 * DOWN, ZERO, DOWN, ZERO]
        inputs[argument] = np.array([0, np.nan, 0])
        assert dut.update(*inputs) == "bad_input"
    assert dut.bad_inputs == 4
    assert dut.updates == 1
    np.testing.assert_array_equal(dut.particles, before)


def test_keyword_arguments_and_shapes():
    dut = dp.ForceSpaceParticleFilter(params=dp.ForceSpaceParticleFilterParams())
    good = {
        "sensed_force": ZERO,
        "velocity": [0, 0, 0],
        "motion_force": (1, 0, 0),
        "contact_force": ZERO,
    }
    assert dut.update(**good) == "ok"
    for name in good:
        with pytest.raises(ValueError, match=rf"^{name}: .*\(3,\).*\(2,\)"):
            dut.update(**{**good, name: np.zeros(2)})
    with pytest.raises(ValueError, match=r"normals: .*\(3, k\).*\(2, 3\)"):
        dut.set_prior(np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"normals: .*\(3, 9\)"):
        dut.set_prior(np.ones((3, 9)))
    with pytest.raises(ValueError, match="normals: expected finite"):
        dut.set_prior(np.full((3, 1), np.nan))


def test_prior_finds_what_no_command_points_to():
    dut = dp.ForceSpaceParticleFilter(PAPER, seed=0)
    for _ in range(20):
        dut.update(2 * DOWN, ZERO, ZERO, ZERO)
    assert dut.dimension == 0
    dut.set_prior(5 * DOWN[:, None])
    np.testing.assert_array_equal(dut.prior, DOWN[:, None])
    for _ in range(20):
        dut.update(2 * DOWN, ZERO, ZERO, ZERO)
    assert dut.dimension == 1
    dut.set_prior(np.zeros((3, 0)))
    assert dut.prior.shape == (3, 0)


def test_prior_is_as_sure_as_it_says():
    """Friction tilts the force by 17 degrees, and nothing slides."""

    def error_deg(std):
        dut = dp.ForceSpaceParticleFilter(
            dp.ForceSpaceParticleFilterParams(period=0.01), seed=1
        )
        dut.set_prior(DOWN[:, None], std=std)
        for _ in range(30):
            dut.update(6 * DOWN + 1.8 * SIDE, ZERO, ZERO, ZERO)
        assert dut.dimension == 1
        return np.degrees(np.arccos(dut.singular_vectors[:, 0] @ DOWN))

    errors = [error_deg(std) for std in (0.05, 0.1, 0.3, 3.0)]
    assert errors == sorted(errors)
    assert errors[0] < 7
    assert errors[-1] > 12
    assert error_deg(None) == errors[1]  # params.prior_std


@pytest.mark.parametrize("std", [0.0, -0.1, 4.0, np.nan, np.inf])
def test_prior_std_out_of_range_changes_nothing(std):
    dut = dp.ForceSpaceParticleFilter(seed=0)
    dut.set_prior(DOWN[:, None], std=0.2)
    with pytest.raises(ValueError, match=r"^std: expected a number in \(0, pi\], got "):
        dut.set_prior(SIDE[:, None], std=std)
    np.testing.assert_array_equal(dut.prior, DOWN[:, None])


def test_friction_cone_says_how_sure_it_is():
    dut = dp.ForceSpaceParticleFilter(
        dp.ForceSpaceParticleFilterParams(period=0.01), seed=1
    )
    assert dut.state.direction_uncertainty == np.pi / 2
    for _ in range(20):
        assert dut.update(6 * DOWN, ZERO, ZERO, ZERO) == "ok"
    pressed = dut.state.direction_uncertainty
    for _ in range(50):
        dut.update(6 * DOWN + 1.8 * SIDE, 0.05 * SIDE, ZERO, ZERO)
    assert dut.dimension == 1
    assert 0 < dut.state.direction_uncertainty < 0.5 * pressed < 0.25
    assert dut.state.dimension_confidence > 0.95
    assert dut.singular_vectors[:, 0] @ DOWN > np.cos(np.radians(2))


def test_state_can_be_copied_and_put_back():
    dut = dp.ForceSpaceParticleFilter(PAPER, seed=4)
    dut.update(8 * DOWN, ZERO, DOWN, ZERO)
    saved = dut.state
    copied = copy.deepcopy(saved)
    dut.update(8 * DOWN, ZERO, DOWN, ZERO)
    after = dut.particles
    assert not np.array_equal(after, saved.particles)
    for state in (saved, copied):
        dut.state = state
        dut.update(8 * DOWN, ZERO, DOWN, ZERO)
        np.testing.assert_array_equal(dut.particles, after)
    dut.reset(4)
    for _ in range(2):
        dut.update(8 * DOWN, ZERO, DOWN, ZERO)
    np.testing.assert_array_equal(dut.particles, after)
    smaller = dp.ForceSpaceParticleFilterParams(num_particles=500)
    with pytest.raises(ValueError, match=r"^state: expected .*num_particles=1000"):
        dut.state = dp.ForceSpaceParticleFilter(smaller).state


def test_algorithm_and_state_are_the_same_filter():
    algorithm = dp.ForceSpaceParticleFilterAlgorithm(PAPER)
    state = algorithm.make_state(seed=6)
    dut = dp.ForceSpaceParticleFilter(PAPER, seed=6)
    algorithm.set_prior(SIDE[:, None], state)
    dut.set_prior(SIDE[:, None])
    for inputs in tour():
        assert algorithm.update(*inputs, state) == dut.update(*inputs)
    np.testing.assert_array_equal(state.particles, dut.particles)
    np.testing.assert_array_equal(state.force_selection, dut.force_selection)
    assert state.dimension == dut.dimension
    assert state.all_weights_zero == dut.all_weights_zero > 0
    smaller = dp.ForceSpaceParticleFilterParams(num_particles=500)
    with pytest.raises(ValueError, match=r"^state: expected"):
        dp.ForceSpaceParticleFilterAlgorithm(smaller).update(
            ZERO, ZERO, ZERO, ZERO, state
        )


def test_params():
    params = dp.ForceSpaceParticleFilterParams(
        num_particles=300,
        update_thresholds=dp.ForceSpaceParticleFilterThresholds(
            force_low=1, force_high=5
        ),
    )
    assert params.period == 1 / 15
    assert params.likelihood == "friction_cone"
    assert params.resampling_thresholds.force_high == 3
    assert pickle.loads(pickle.dumps(params)) == params
    assert params != dp.ForceSpaceParticleFilterParams()
    with pytest.raises(TypeError, match="num_particle"):
        dp.ForceSpaceParticleFilterParams(num_particle=3)
    with pytest.raises(
        ValueError, match=r"`num_particles` expected a number in \[2, 100000\], got 0"
    ):
        dp.ForceSpaceParticleFilterParams(num_particles=0)
    with pytest.raises(ValueError, match=r"`likelihood` expected one of \"paper\""):
        dp.ForceSpaceParticleFilterParams(likelihood="guess")
    params.alpha_remove = 0.7
    with pytest.raises(ValueError, match=r"`alpha_remove` .*got 0\.7"):
        dp.ForceSpaceParticleFilter(params)
