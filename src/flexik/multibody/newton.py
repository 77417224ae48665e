"""Static equilibria of an Exudyn system by Newton's method: fast, or with the exact Jacobian."""

from typing import Any

import exudyn as exu
import numpy as np

from flexik.machines.sections import Array

# Steps of displacements in m and rad, and of forces of joints in N, that a column of the exact
# Jacobian takes; and the steps of Newton's method, which needs 4 to 6 if it gets there
STEP, FORCE_STEP = 1e-7, 1.0
EXACT_STEPS = 12
# Share of all loads below which the fast way is given up
SMALLEST_LOAD_STEP = 0.05


def static_settings(tolerance: float) -> exu.SimulationSettings:
    """Static equilibrium to the residual `tolerance` of Newton's method, N and N m."""
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    static = settings.staticSolver
    static.verboseMode = 0
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    static.newton.absoluteTolerance = tolerance
    static.newton.relativeTolerance = 0.0
    static.minimumStepSize = SMALLEST_LOAD_STEP
    # the Jacobian of such a machine hardly changes
    static.newton.useModifiedNewton = True
    # weights hardly stiffen a machine: their Jacobian only costs time
    static.computeLoadsJacobian = False
    return settings


def solved(system: exu.MainSystem, settings: exu.SimulationSettings) -> bool:
    """Go from the present state to static equilibrium; whether there is one."""
    try:
        found = exu.MainSolverStatic().SolveSystem(system, settings)  # type: ignore[call-arg,misc]
    except exu.SolverError:  # a singular matrix
        return False
    return bool(found) and bool(np.isfinite(system.systemData.GetODE2Coordinates()).all())


def solved_exactly(system: exu.MainSystem, settings: exu.SimulationSettings) -> bool:
    """As `solved`, with the Jacobian by differences of the residual, some 100 times slower.

    Exudyn's leaves out how the forces of joints turn with the bodies. Under loads far above those
    of service its steps then grow instead of shrinking, where nothing is wrong with the machine.
    """
    data, initial = system.systemData, exu.ConfigurationType.Initial
    solver: Any = exu.MainSolverStatic()
    current = exu.ConfigurationType.Current
    solver.InitializeSolver(system, settings)
    x = np.array([*data.GetODE2Coordinates(initial), *data.GetAECoordinates(initial)])
    n = len(data.GetODE2Coordinates(initial))
    steps = np.where(np.arange(len(x)) < n, STEP, FORCE_STEP)

    def residual(at: Array) -> Array:
        data.SetODE2Coordinates(at[:n].tolist(), configuration=current)
        data.SetAECoordinates(at[n:].tolist(), configuration=current)
        solver.ComputeNewtonResidual(system, settings)
        return np.array(solver.GetSystemResidual())

    for _ in range(EXACT_STEPS):
        left = residual(x)
        if not np.isfinite(left).all():
            return False
        if np.linalg.norm(left) < settings.staticSolver.newton.absoluteTolerance:
            return True
        columns = [residual(x + by) - residual(x - by) for by in np.diag(steps)]
        try:
            x = x - np.linalg.solve((np.array(columns) / (2 * steps[:, None])).T, left)
        except np.linalg.LinAlgError:
            return False
    return False
