"""Compiler options, which let a processor's vector unit work on a pair sum."""

import jax

COMPILER_OPTIONS = {
    "xla_cpu_enable_fast_math": True,  # sums may be reordered ...
    "xla_cpu_fast_math_honor_nans": True,  # ... and nothing else of what the name promises
    "xla_cpu_fast_math_honor_infs": True,
    "xla_cpu_fast_math_honor_division": True,
    "xla_cpu_fast_math_honor_functions": True,
}
"""For `jax.jit(function, compiler_options=jaxsph.COMPILER_OPTIONS)`, outermost, or `.compile(...)`.

XLA adds up the terms of a sum in their order, one after another; with these it may add several
lanes at once, and a pair sum takes half the time on a CPU (`benchmarks.right_hand_side`). Results
differ by rounding. A NaN stays a NaN, infinities and divisions are as always. `simulate` and
`sweep` compile with them on a CPU; a program of your own does if you say so. All are options of the
CPU, and do nothing elsewhere.
"""


def platform_options(platform: str | None = None) -> dict[str, bool]:
    """What programs are compiled with on a platform, JAX's default one if none is given.

    `COMPILER_OPTIONS` on a CPU. A GPU adds up in parallel as it is and needs none.
    """
    return dict(COMPILER_OPTIONS) if (platform or jax.default_backend()) == "cpu" else {}
