"""Every test runs in double precision and without silent dtype or rank promotion.

Compilation is half of the time of the tests. Programs that several of them compile are kept for the
length of a run, for all its processes.
"""

import atexit
import os
import shutil
import tempfile

import hypothesis
import jax

_KEPT = "JAX_COMPILATION_CACHE_DIR"
if _KEPT not in os.environ:  # in the first process; all others are its children
    os.environ[_KEPT] = tempfile.mkdtemp(prefix="jaxsph-tests-")
    atexit.register(shutil.rmtree, os.environ[_KEPT], ignore_errors=True)
jax.config.update("jax_compilation_cache_dir", os.environ[_KEPT])
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.3)

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")

# An example that compiles is slow once; a failure must come back on the next run.
hypothesis.settings.register_profile("jaxsph", deadline=None, derandomize=True)
hypothesis.settings.load_profile("jaxsph")
