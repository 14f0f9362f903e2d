"""The example laws of Mohr-Coulomb and of the circular cone, called as libraries."""

import numpy as np
import pytest
from scipy.optimize import minimize, nnls

from cases.programs import program
from laws import ABAQUS, VOIGT, Block, Esm, Umat, triaxial

pytestmark = pytest.mark.skipif(
    not program("laws/libmohr_coulomb.so").exists(), reason="the example laws are not built"
)
YOUNG, POISSON = 1e7, 0.3
BULK, SHEAR = YOUNG / (3 * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))
SANDY = [YOUNG, POISSON, 33.0, 7.0, 2e3]  # phi, psi [deg], c [Pa]
KINDS = {
    "sandy": SANDY,
    "associated": [YOUNG, POISSON, 30.0, 30.0, 1e3],
    "cohesionless": [YOUNG, POISSON, 33.0, 0.0, 0.0],
    "tresca": [YOUNG, POISSON, 0.0, 0.0, 5e3],
}


def tensor(components) -> np.ndarray:
    full = np.zeros((3, 3))
    for value, (i, j) in zip(components, VOIGT, strict=True):
        full[i, j] = full[j, i] = value
    return full


def components(full: np.ndarray) -> np.ndarray:
    return np.array([full[i, j] for i, j in VOIGT])


def random_walk(seed: int, steps: int = 200) -> np.ndarray:
    """Strain increments that load, unload, shear and tear."""
    random = np.random.default_rng(seed)
    size = 10 ** random.uniform(-5, -2.5, (steps, 1))
    return random.normal(size=(steps, 6)) * size - 0.05 * size * np.array([1, 1, 1, 0, 0, 0])


def elastic(strain) -> np.ndarray:
    full = tensor(strain)
    return components((BULK - 2 / 3 * SHEAR) * np.trace(full) * np.eye(3) + 2 * SHEAR * full)


def yields(constants, stress) -> float:
    """Mohr and Coulomb's function of the largest and the least principal stress [Pa]."""
    least, _, most = np.linalg.eigvalsh(tensor(stress))
    sine, cosine = np.sin(np.radians(constants[2])), np.cos(np.radians(constants[2]))
    return most - least - (most + least) * sine - 2 * constants[4] * cosine


def walked(law, steps) -> list:
    """Every step's answer, from 10 kPa."""
    stress, answers = np.array([1e4, 1e4, 1e4, 0, 0, 0]), []
    for step in steps:
        answers.append(law.update(stress, step))
        stress = answers[-1].stress
    return answers


@pytest.mark.parametrize("kind", KINDS)
def test_three_interfaces_are_one_law(kind):
    """To 1e-12 of the largest stress, over 200 steps, planes, edges and apex among them."""
    steps = random_walk(1)
    umat, esm, block = (
        np.array([answer.stress for answer in walked(law("mohr_coulomb", KINDS[kind]), steps)])
        for law in (Umat, Esm, Block)
    )
    size = np.abs(umat).max()
    assert np.abs(umat - esm).max() <= 1e-12 * size
    assert np.abs(umat - block).max() <= 1e-12 * size
    # the control: Anura3D's order of the shear components read as Abaqus's is another law
    mixed = np.array(
        [a.stress for a in walked(Umat("mohr_coulomb", KINDS[kind]), steps[:, ABAQUS])]
    )
    assert np.abs(mixed - esm).max() > 1e-3 * size


def test_moduli_and_energies_are_told_alike():
    umat, block = Umat("mohr_coulomb", SANDY), Block("mohr_coulomb", SANDY)
    stress = np.array([1e4, 1e4, 1e4, 0, 0, 0])
    for step in random_walk(2):
        a, b = umat.update(stress, step), block.update(stress, step)
        assert (a.stored, a.dissipated) == pytest.approx((b.stored, b.dissipated), rel=1e-12)
        assert b.modulus == pytest.approx(BULK + 4 / 3 * SHEAR, rel=1e-12)
        stress = a.stress
    assert Esm("mohr_coulomb", SANDY).update(stress, step).modulus == b.modulus


def test_a_block_is_its_points():
    block, strain = Block("mohr_coulomb", SANDY), random_walk(3, 64)
    stress = np.tile([1e4, 1e4, 1e4, 0, 0, 0], (64, 1))
    together = block.points(stress, strain)
    for i in range(64):
        assert np.array_equal(together[i].stress, block.update(stress[i], strain[i]).stress)


@pytest.mark.parametrize("kind", KINDS)
def test_return_is_along_the_flow_onto_the_surface(kind):
    """What was taken away is elasticity of non-negative amounts of the flows of the planes that
    the stress ends on: the definition of a return mapping (Koiter's rule), solved here by NNLS.
    """
    constants = KINDS[kind]
    law, found = Umat("mohr_coulomb", constants), np.zeros(4, int)
    slope = (1 + np.sin(np.radians(constants[3]))) / (1 - np.sin(np.radians(constants[3])))
    random = np.random.default_rng(4)
    for _ in range(300):
        stress = np.array([1e4, 1e4, 1e4, 0, 0, 0])
        strain = random.normal(size=6) * 10 ** random.uniform(-3.5, -2)
        strain[:3] -= random.choice([0.0, 5e-4, 3e-3])
        trial = stress + elastic(strain)
        answer = law.update(stress, strain).stress
        size = np.abs(trial).max()
        if yields(constants, trial) <= 0:
            assert np.abs(answer - trial).max() <= 1e-12 * size
            continue
        assert abs(yields(constants, answer)) <= 1e-11 * size
        values, axes = np.linalg.eigh(tensor(trial))
        kept = axes.T @ tensor(answer) @ axes
        assert np.abs(kept - np.diag(np.diag(kept))).max() <= 1e-10 * size  # the same axes
        kept = np.diag(kept)
        active = []
        for i, j in np.ndindex(3, 3):  # flow of the plane of the least stress i and the most j
            if i != j and kept[j] - kept[i] >= kept.max() - kept.min() - 1e-9 * size:
                flow = np.zeros(3)
                flow[i], flow[j] = -slope, 1.0
                active.append(2 * SHEAR * flow + (BULK - 2 / 3 * SHEAR) * flow.sum())
        found[min(len(active), 4) // 2 + (kept.max() - kept.min() < 1e-9 * size)] += 1
        if kept.max() - kept.min() >= 1e-9 * size or constants[3] > 0:
            amounts, rest = nnls(np.array(active).T, values - kept)
            assert rest <= 1e-9 * size and amounts.max() > 0
    assert found[0] > 10 and found[1] > 10  # planes and edges
    assert (found[3] + found[2] > 10) == (constants[2] > 0)  # an apex, where there is friction


def test_associated_return_is_the_closest_point():
    """In the energy of elasticity, among the stresses that do not yield: found by a minimiser that
    knows nothing of planes and edges.
    """
    constants = KINDS["associated"]
    law, random = Umat("mohr_coulomb", constants), np.random.default_rng(5)
    k = (1 + np.sin(np.radians(30))) / (1 - np.sin(np.radians(30)))
    strength = 2 * constants[4] * np.sqrt(k)
    flexible = np.eye(3) / YOUNG * (1 + POISSON) - POISSON / YOUNG
    planes = np.array([[-k if n == i else float(n == j) for n in range(3)]
                       for i in range(3) for j in range(3) if i != j])  # fmt: skip
    for _ in range(40):
        trial = np.array([1e4, 1e4, 1e4]) + random.normal(size=3) * 2e4
        answer = law.update([1e4, 1e4, 1e4, 0, 0, 0], np.r_[flexible @ (trial - 1e4), 0, 0, 0])
        closest = minimize(
            lambda s: (trial / 1e4 - s) @ flexible @ (trial / 1e4 - s) * YOUNG,
            np.ones(3),
            constraints={"type": "ineq", "fun": lambda s: strength / 1e4 - planes @ s},
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 500},
        ).x
        # the minimiser's own error: the square root of ftol
        assert answer.stress[:3] == pytest.approx(1e4 * closest, abs=1e-2)


def difference(law, stress, strain, at=1e-9) -> np.ndarray:
    """d(stress)/d(strain component) of a step, by central differences."""
    columns = []
    for n in range(6):
        side = at * np.eye(6)[n]
        more, less = law.update(stress, strain + side), law.update(stress, strain - side)
        columns.append((more.stress - less.stress) / (2 * at))
    return np.array(columns).T


@pytest.mark.parametrize("kind", [*KINDS, "cone"])
def test_tangent_is_the_derivative_of_the_step(kind):
    """Of elastic and plastic steps, to the differences' own error; the elastic one is no such."""
    law = Umat("drucker_prager_umat", [BULK, SHEAR, 1.1]) if kind == "cone" else None
    law = law or Umat("mohr_coulomb", KINDS[kind])
    random, plastic = np.random.default_rng(6), 0
    for _ in range(60):
        stress = np.array([1e4, 1e4, 1e4, 0, 0, 0])
        strain = random.normal(size=6) * 2e-3 + np.array([5e-4, 5e-4, 5e-4, 0, 0, 0])
        tangent, near = law.update(stress, strain).tangent, difference(law, stress, strain)
        assert np.abs(tangent - near).max() <= 1e-5 * YOUNG
        plastic += np.abs(near - difference(law, stress, 1e-8 * strain)).max() > 0.1 * YOUNG
    assert plastic > 20


@pytest.mark.parametrize(
    "law, constants",
    [
        ("mohr_coulomb", SANDY),
        ("drucker_prager_umat", [BULK, SHEAR, 1.1]),
        ("drucker_prager", [BULK, SHEAR, 1.1]),
    ],
)
def test_work_is_stored_or_dissipated(law, constants):
    """Exactly, by the trapezoidal rule, where stress does not oppose the flow; never negative."""
    stress, work, total = np.array([1e4, 1e4, 1e4, 0, 0, 0]), 0.0, 0.0
    stored = first = 1e4**2 / (2 * BULK)
    law = (Block if law == "drucker_prager" else Umat)(law, constants)
    direction = np.array([1e-5, -0.4e-5, -0.4e-5, 0.5e-5, 0.2e-5, 0])
    for _ in range(300):
        answer = law.update(stress, direction)
        work += 0.5 * (stress + answer.stress) @ (direction * [1, 1, 1, 2, 2, 2])
        assert answer.dissipated >= 0
        total += answer.dissipated
        stress, stored = answer.stress, answer.stored
    assert total > 0.1 * work  # enough for its rule to be tested
    assert stored - first + total == pytest.approx(work, rel=1e-10)


def test_cone_in_c_and_in_fortran_are_one_law():
    steps = random_walk(7)
    c, fortran = (
        walked(law, steps)
        for law in (
            Block("drucker_prager", [BULK, SHEAR, 1.1]),
            Umat("drucker_prager_umat", [BULK, SHEAR, 1.1]),
        )
    )
    size = max(np.abs(a.stress).max() for a in c)
    open_points = 0
    for a, b in zip(c, fortran, strict=True):
        assert np.abs(a.stress - b.stress).max() <= 1e-12 * size
        assert (a.stored, a.dissipated) == pytest.approx((b.stored, b.dissipated), rel=1e-9)
        open_points += not a.stress.any()
    assert open_points > 10


@pytest.mark.parametrize("ratio", [0.6, 1.2])
def test_mohr_coulomb_is_the_cone_in_triaxial_compression(ratio):
    """sin(phi) = 3 M/(6 + M) and no dilation: one Lode angle, so one law, to round-off."""
    sine = 3 * ratio / (6 + ratio)
    hexagon = Umat("mohr_coulomb", [YOUNG, POISSON, np.degrees(np.arcsin(sine)), 0.0, 0.0])
    cone = Umat("drucker_prager_umat", [BULK, SHEAR, ratio])
    block = Block("drucker_prager", [BULK, SHEAR, ratio])
    paths = [triaxial(law, 1e4, [], 0.01, 50) for law in (hexagon, cone, block)]
    for path in paths:
        assert np.abs(path.stress - paths[0].stress).max() <= 1e-8 * 1e4
        assert path.mobilised[-1] == pytest.approx(sine, rel=1e-9)
    # the control: in triaxial extension the hexagon lies within the cone
    pulled = [triaxial(law, 1e4, [], -0.01, 50) for law in (hexagon, cone)]
    q = [path.stress[-1, 1] - path.stress[-1, 0] for path in pulled]
    assert q[0] < 0.95 * q[1]
