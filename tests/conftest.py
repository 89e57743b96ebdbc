"""Every test runs in double precision and without silent dtype or rank promotion."""

import hypothesis
import jax

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")

# An example that compiles is slow once; a failure must come back on the next run.
hypothesis.settings.register_profile("jaxsph", deadline=None, derandomize=True)
hypothesis.settings.load_profile("jaxsph")
