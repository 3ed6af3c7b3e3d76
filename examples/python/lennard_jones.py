"""Energy, forces and pressure of a Lennard-Jones crystal in a triclinic cell, by gradients of PyTorch.

find_neighbors() finds indices and shifts, which have no gradient. Distances are computed from them by
PyTorch, so that the energy has gradients by the positions and by the cell.

    python lennard_jones.py
"""

# %% A disturbed crystal; lengths in sigma, energies in epsilon
import itertools

import numpy as np
import torch

import jfpx

CUTOFF = 2.5
AT_CUTOFF = 4 * (CUTOFF**-12 - CUTOFF**-6)  # the energy of a pair is 0 at the cutoff

cell = torch.tensor([[5.8, 0, 0], [1.1, 5.7, 0], [-0.6, 1.4, 5.6]], dtype=torch.float64)
grid = np.array(list(itertools.product(range(5), repeat=3)))
places = (grid + np.random.default_rng(1).normal(0, 0.03, grid.shape)) / 5
positions = torch.from_numpy(places) @ cell


# %% The energy of a list of neighbours
def energy_of(positions, cell):
    """The sum of 4 (r^-12 - r^-6) over all pairs within the cutoff."""
    found = jfpx.find_neighbors(positions, CUTOFF, cell=cell, index_dtype="int64")
    i, j = found.pairs
    vectors = positions[j] - positions[i] + found.shifts.to(positions.dtype) @ cell
    attraction = (vectors**2).sum(dim=1) ** -3
    return (4 * (attraction**2 - attraction) - AT_CUTOFF).sum()


# %% Forces are the negative gradient by the positions
positions.requires_grad_()
energy = energy_of(positions, cell)
forces, = torch.autograd.grad(-energy, positions)
print(f"{len(positions)} atoms: energy {energy.item():.6f}, largest force {forces.norm(dim=1).max().item():.6f}")
assert forces.sum(dim=0).abs().max() < 1e-9 * forces.abs().max()

# %% The same by finite differences, with a new list for each
STEP = 1e-5
points = positions.detach()
for atom, axis in [(0, 0), (17, 1), (124, 2)]:
    moved = torch.zeros_like(points)
    moved[atom, axis] = STEP
    difference = (energy_of(points - moved, cell) - energy_of(points + moved, cell)) / (2 * STEP)
    print(f"atom {atom}, axis {axis}: {forces[atom, axis].item():.6f}, by differences {difference.item():.6f}")
    assert abs(difference - forces[atom, axis]) < 1e-5 * forces.abs().max()
print("forces are the differences of the energy")


# %% The pressure is the negative derivative by the volume: of a strain of positions and cell
def energy_of_strain(strain):
    scaled = 1 + strain
    return energy_of(points * scaled, cell * scaled)


volume = torch.linalg.det(cell)
strain = torch.zeros((), dtype=torch.float64, requires_grad=True)
gradient, = torch.autograd.grad(energy_of_strain(strain), strain)
pressure = -gradient / (3 * volume)
difference = (energy_of_strain(-STEP) - energy_of_strain(STEP)) / (2 * STEP) / (3 * volume)
print(f"pressure without motion: {pressure.item():.6f}, by differences {difference.item():.6f}")
assert abs(difference - pressure) < 1e-5 * abs(pressure)
