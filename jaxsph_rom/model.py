"""The reduced model: modal coordinates and moving particles, in the protocol of the time loop."""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from jaxsph import NeighborSearch, ParticleState, Snapshot, SPHFunctional, WalledSearch
from jaxsph.clumping import CLUMPED
from jaxsph.compiled import full_precision
from jaxsph.effects import Effect
from jaxsph.full_model import (
    DENSITY_BOUNDS,
    SHIFT_SHARE,
    list_checks,
    refresh_list,
    wall_checks,
)
from jaxsph.integrate import Fault, FaultCode, Model
from jaxsph.scenes import Scene

from .basis import Basis
from .field_advection import Advection, ModeAdvection
from .mode_interpolation import ModeInterpolation
from .projection import Projection, PseudoInverse
from .still_walls import check_still

_MARGIN = 0.25  # times dx: no particle comes nearer to a wall


class ReducedState(eqx.Module):
    """Reduced coordinates (M,) and particle positions (N, n) [m]; also their rates."""

    coordinates: Float[Array, " modes"]
    position: Float[Array, "particles dim"]


class ReducedModel(Model):
    """A projection-based reduced model on moving particles (paper, section 3.3):

        d(w^)/dt = projection of f-bar(centre + Phi~(x) w^),    dx/dt = u~ + du~.

    As modes do not keep particles inside walls, those that come too near are put back after each
    step; particles that clump are a fault. It runs in the full model's loop. At every stage the
    modes are carried to the particles, so its cost is that of a full right-hand side and more.

    Args:
        functional: what of f-bar the effects make.
        projection: `Galerkin()` or `AdjointPetrovGalerkin(tau)`.
        interpolation: of `basis.functions`, ordered (field, function).
        basis: the modes at the reference points, with centre and inner product.
        search: neighbour search.
        advection: how the Eulerian f-bar follows from the functional (static).

    Examples:
        >>> import numpy as np
        >>> import jaxsph
        >>> from jaxsph.arrangements import Lattice
        >>> from jaxsph_rom import Energy, Galerkin, LocalSplines, ReducedModel, ReferenceSpace, pod
        >>> scene = jaxsph.scenes.taylor_green(16, end_time=0.06, arrangement=Lattice())
        >>> full = jaxsph.run_scene(scene)
        >>> reference = ReferenceSpace(scene.state.position, scene.space)
        >>> basis = pod(reference.snapshots(full), Energy(), scene.fluid, modes=2)
        >>> functions = basis.functions.reshape(256, -1)  # on the points, ordered (field, mode)
        >>> splines = LocalSplines.fit(np.asarray(reference.points), functions, scene.space)
        >>> model = ReducedModel.of_scene(scene, basis, splines, Galerkin())
        >>> reduced = jaxsph.simulate(
        ...     model, model.project(scene.state), scene.schedule
        ... )
        >>> reduced.coordinates.shape  # snapshots, modes
        (4, 2)
        >>> bool(np.abs(reduced.velocity[-1] - full.velocity[-1]).max() < 0.05)  # of 1 m/s
        True
    """

    functional: SPHFunctional
    projection: Projection
    interpolation: ModeInterpolation
    basis: Basis
    search: NeighborSearch | WalledSearch
    advection: Advection = eqx.field(static=True, default=ModeAdvection())

    @classmethod
    def of_scene(
        cls,
        scene: Scene,
        basis: Basis,
        interpolation: ModeInterpolation,
        projection: Projection,
        advection: Advection | None = None,
        margin: float | None = None,
    ) -> ReducedModel:
        """The reduced model of a scene; its parameters (viscosity and so on) are the scene's.

        Args:
            scene: whose effects, walls and steps the model has.
            basis: the modes.
            interpolation: of `basis.functions`.
            projection: of the rates.
            advection: how f-bar is made; `ModeAdvection()` if none is given.
            margin: of the neighbour search's capacities; as of `Scene.search`.

        Raises:
            ValueError: if the interpolation is not of `basis.functions`, bodies are moved through
                the fluid, or the advection does not suit the scene.
        """
        check_still(scene)
        wanted, found = basis.functions[0].size, interpolation.functions
        if found != wanted:
            raise ValueError(
                f"interpolation: of {found} functions, but the basis has {wanted}; fit them to "
                "`basis.functions`."
            )
        advection = ModeAdvection() if advection is None else advection
        functional = eqx.tree_at(
            lambda f: f.effects,
            scene.functional(),
            advection.eulerian(scene.effects),
            is_leaf=lambda x: isinstance(x, tuple),
        )
        basis = eqx.tree_at(
            lambda b: (b.modes, b.centre, b.weights),
            basis,
            tuple(
                jnp.asarray(a, scene.state.density.dtype)
                for a in (basis.modes, basis.centre, basis.weights)
            ),
        )
        search = scene.search(margin=margin)
        return cls(functional, projection, interpolation, basis, search, advection)

    def basis_at(
        self, position: Array
    ) -> tuple[Float[Array, "particles fields modes"], Float[Array, "#particles fields"]]:
        """Phi~(x) and the centre at particle positions."""
        fields = self.basis.modes.shape[1]
        return self.basis.parts(self.interpolation(position).reshape(position.shape[0], fields, -1))

    def pseudo_inverse(self, modes: Array) -> PseudoInverse:
        """Phi~^+ in the basis' inner product."""
        flat = modes.reshape(-1, modes.shape[2])
        return PseudoInverse(flat, jnp.tile(self.basis.weights, modes.shape[0]))

    @full_precision
    def project(self, state: ParticleState) -> ReducedState:
        """The reduced state nearest to a full one, at the same positions."""
        fields = jnp.concatenate([state.density[:, None], state.velocity], axis=1)
        modes, centre = self.basis_at(state.position)
        inverse = self.pseudo_inverse(modes)
        return ReducedState(inverse((fields - centre).reshape(-1)), state.position)

    @full_precision
    def reconstruct(self, state: ReducedState) -> ParticleState:
        """The full state that a reduced one stands for, (rho, u) = centre + Phi~ w^."""
        modes, centre = self.basis_at(state.position)
        fields = centre + modes @ state.coordinates
        return ParticleState(state.position, fields[:, 1:], fields[:, 0])

    def prepare(self, state):
        return self.search.build(state.position)

    def refresh(self, auxiliary, state, time_step):
        speed = (1.0 + SHIFT_SHARE) * self.functional.fluid.reference_speed
        return refresh_list(self.search, auxiliary, state.position, speed * time_step)

    @full_precision
    def stacked_rates(
        self,
        time,
        stacked: Float[Array, " states"],
        position: Array,
        auxiliary,
        coordinates: Float[Array, " modes"],
    ) -> tuple[Float[Array, " states"], Float[Array, "particles dim"]]:
        """f-bar of the stacked state (rho, u) at these positions, and dx/dt there.

        Args:
            coordinates: of the fields whose gradients carry, where these are the modes' own.
        """
        fields = stacked.reshape(position.shape[0], -1)
        particles = ParticleState(position, fields[:, 1:], fields[:, 0])
        rates = self.functional(time, particles, auxiliary)
        seen = jnp.concatenate([rates.density[:, None], rates.velocity], axis=1)

        def carried():
            fields = self.interpolation.combined(self.basis.combination(coordinates)[0])
            return fields.slope_along(position, rates.position)

        found = self.advection.remaining(seen, particles.density, carried)
        return found.reshape(-1), rates.position

    @full_precision
    def rates(self, time, state, auxiliary):
        modes, centre = self.basis_at(state.position)
        inverse = self.pseudo_inverse(modes)
        resolved = inverse.expand(state.coordinates).reshape(modes.shape[:2])
        # a border for the compiler, which else lays the modes out as the sums over pairs want it
        stacked = lax.optimization_barrier((centre + resolved).reshape(-1))

        def full_rates(stacked):
            return self.stacked_rates(time, stacked, state.position, auxiliary, state.coordinates)

        coordinates, transport = self.projection.reduce(inverse, full_rates, stacked)
        return ReducedState(coordinates, transport)

    def finish(self, state):
        space, walls = self.functional.space, self.functional.walls
        position = space.box.wrap(state.position)
        if walls is not None:
            position = walls.put_inside(position, _MARGIN * space.spacing)
        return eqx.tree_at(lambda s: s.position, state, position)

    def inspect(self, step, state, auxiliary):
        position, coordinates = state.position, state.coordinates
        wild = ~jnp.isfinite(jnp.sum(position, axis=1))
        lost = ~jnp.all(jnp.isfinite(coordinates))
        density = self.basis.centre[:, 0] + self.basis.modes[:, 0, :] @ coordinates
        ratio = lax.stop_gradient(density / self.functional.fluid.reference_density)
        out = (ratio < DENSITY_BOUNDS[0]) | (ratio > DENSITY_BOUNDS[1])
        space = self.functional.space
        apart, nearest = auxiliary.closest(space.box, position)
        return Fault.first_of(
            step,
            (FaultCode.NOT_FINITE, lost, -1),
            (FaultCode.NOT_FINITE, jnp.any(wild), jnp.argmax(wild)),
            (FaultCode.DENSITY_OUT_OF_BOUNDS, jnp.any(out), -1),
            *wall_checks(self.functional.walls, position),
            (FaultCode.CLUMPED, apart < CLUMPED * space.spacing, nearest),
            *list_checks(self.search, auxiliary, position),
            (FaultCode.SPLINE_CELL_OVERFLOW, self.interpolation.overflow(position), -1),
        )

    def with_effect(self, effect: Effect):
        """The same with other coefficients of one effect; see `SPHFunctional.with_effect`."""
        return dataclasses.replace(self, functional=self.functional.with_effect(effect))

    def enlarged(self):
        return dataclasses.replace(self, search=self.search.enlarged())

    def observe(self, state):
        full = self.reconstruct(state)
        return Snapshot(
            position=full.position,
            velocity=full.velocity,
            density=full.density,
            pressure=self.functional.fluid.pressure(full.density),
            coordinates=state.coordinates,
        )
