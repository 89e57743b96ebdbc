"""Tables of the pages in docs/measured, made from the stored results.

    python -m benchmarks.pages

A table stands between `<!-- table NAME -->` and `<!-- end -->`; this writes all of them anew. A
test compares them with the results, so that no number on a page is stale.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from .body_tables import channel_cylinder, floating_ball, floating_box, light_bodies, taylor_couette
from .full_tables import (
    cavity_of_pysph,
    dam_break_3d,
    free_flows,
    right_hand_sides,
    schemes,
    settled_cavity,
    still_water,
    versions,
)
from .gpu_tables import ahead_of_time, device_differences, devices, scale, sums_on_a_gpu
from .reduced_tables import (
    cheapest_settings,
    density_readings,
    label_galerkin,
    label_models,
    label_samples,
    larger_cavity,
    paper_energy,
    paper_half,
    paper_size,
    paper_small,
    particle_cavity,
    particle_step,
    particle_vortex,
    predicted_cavity,
    predicted_vortex,
    scheme_models,
    settled_open_cavity,
)
from .table_text import ROOT
from .wake_tables import (
    backward_facing_step,
    cylinder_wake,
    drag_slopes,
    open_flux,
    wake_models,
    wake_transients,
)

PAGES = ROOT / "docs" / "measured"
_BLOCK = re.compile(r"(<!-- table ([\w-]+) -->\n).*?(?=^<!-- end -->)", re.MULTILINE | re.DOTALL)


def main() -> int:
    """Write all tables anew."""
    for page in sorted(PAGES.glob("*.md")):
        page.write_text(refreshed(page.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


def refreshed(text: str) -> str:
    """A page with its tables as the results have them.

    Raises:
        KeyError: if there is no table of a name.
    """
    return _BLOCK.sub(lambda block: f"{block[1]}\n{TABLES[block[2]]()}\n\n", text)


TABLES: dict[str, Callable[[], str]] = {
    table.__name__.replace("_", "-"): table
    for table in (
        schemes,
        right_hand_sides,
        scheme_models,
        settled_cavity,
        cavity_of_pysph,
        still_water,
        free_flows,
        dam_break_3d,
        paper_small,
        paper_half,
        paper_size,
        paper_energy,
        particle_vortex,
        particle_cavity,
        predicted_vortex,
        predicted_cavity,
        larger_cavity,
        settled_open_cavity,
        particle_step,
        versions,
        ahead_of_time,
        sums_on_a_gpu,
        scale,
        devices,
        device_differences,
        cheapest_settings,
        density_readings,
        label_models,
        label_samples,
        label_galerkin,
        open_flux,
        backward_facing_step,
        cylinder_wake,
        drag_slopes,
        wake_models,
        wake_transients,
        floating_box,
        floating_ball,
        light_bodies,
        channel_cylinder,
        taylor_couette,
    )  # fmt: skip
}

if __name__ == "__main__":
    raise SystemExit(main())
