"""Every test runs in double precision and without silent dtype or rank promotion."""

import os
from pathlib import Path

import hypothesis
import jax
import pytest

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")

# An example that compiles is slow once; a failure must come back on the next run.
hypothesis.settings.register_profile("jaxsph", deadline=None, derandomize=True)
hypothesis.settings.load_profile("jaxsph")

_MAPPINGS = Path("/proc/self/maps")  # where there is such a thing
_MOST = 25_000  # a process may have 65,530 on Linux


# Tests compile much and run little. XLA's former code generator, fewer passes over a program and
# the shorter vectors make it in half to two thirds of the time; it then runs a fifth slower, and
# adds up in order where COMPILER_OPTIONS would not. So users are without these.
_SOONER = (
    "--xla_cpu_use_fusion_emitters=false",
    "--xla_backend_optimization_level=1",
    "--xla_cpu_max_isa=AVX2",
    "--xla_backend_extra_options=xla_cpu_disable_loop_unrolling,xla_cpu_disable_slp_vectorizer",
)


def pytest_configure(config):
    """Programs that one process has compiled are kept for all others, and for the next run."""
    flags = os.environ.get("XLA_FLAGS", "").split()
    added = [flag for flag in _SOONER if not any(f.startswith(flag.split("=")[0]) for f in flags)]
    # before JAX looks; workers and commands that tests run inherit it
    os.environ["XLA_FLAGS"] = " ".join([*flags, *added])
    if hasattr(config, "cache") and not hasattr(config, "workerinput"):
        kept = {
            "JAX_COMPILATION_CACHE_DIR": str(config.cache.mkdir("programs")),
            "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
            "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
        }
        os.environ.update(kept)  # read by workers, and by commands that tests run
        for name, value in kept.items():
            jax.config.update(name.lower(), value if "DIR" in name else int(value))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """What a test marked `run_once` compiles is hardly optimised: made sooner, run several times
    slower, so for programs that take a few steps."""
    jax.config.update("jax_disable_most_optimizations", bool(item.get_closest_marker("run_once")))
    return (yield)


@pytest.fixture(autouse=True, scope="module")
def room_for_programs():
    """Each compiled program holds some mappings of memory; thousands of them end the process."""
    yield
    if _MAPPINGS.exists() and _MAPPINGS.read_bytes().count(b"\n") > _MOST:
        jax.clear_caches()
