"""Counting in compiled programs; and, where CUDA's wheels are, the figures that are stored."""

import json
import os
from pathlib import Path

import pytest

from benchmarks.ahead_of_time import counted, main

STORED = Path(__file__).parents[2] / "benchmarks" / "results" / "ahead_of_time.json"
WHEELS = os.environ.get("JAXSPH_CUDA_WHEELS")  # a folder, see `benchmarks.ahead_of_time`
ROOM = 1.15  # other versions fuse a little otherwise

PROGRAM = """HloModule jit_f

%body (p: (s32[], f32[4])) -> (s32[], f32[4]) {
  %p = (s32[], f32[4]{0}) parameter(0)
  %x = f32[4]{0} get-tuple-element(%p), index=1
  %a = f32[4]{0} fusion(%x), kind=kLoop, calls=%fused
  %b = (f32[4]{0}, /*index=1*/f32[4]{0}) custom-call(%a), custom_call_target="triton"
  ROOT %t = (s32[], f32[4]{0}) tuple(%x, %a)
}

%cond (p: (s32[], f32[4])) -> pred[] {
  ROOT %c = pred[] fusion(%p), kind=kLoop, calls=%fused
}

%short (q: f32[4]) -> f32[4] {
  ROOT %q = f32[4]{0} parameter(0)
}

%long (q: f32[4]) -> f32[4] {
  %s = f32[4]{0} sort(%q), dimensions={0}
  ROOT %u = f32[4]{0} copy(%s)
}

ENTRY %main (x: f32[4]) -> f32[4] {
  %x = f32[4]{0} parameter(0)
  %w = (s32[], f32[4]{0}) while(%x), condition=%cond, body=%body, TURNS
  %d = f32[4]{0} conditional(%k, %x, %x), branch_computations={%short, %long}
  %e = f32[4]{0} call(%d), to_apply=%long
  ROOT %f = f32[4]{0} fusion(%e), kind=kLoop, calls=%fused
}
"""


def test_loops_count_their_turns_and_branches_their_longer_one():
    seven = PROGRAM.replace("TURNS", 'backend_config={"known_trip_count":{"n":"7"}}')
    assert counted(seven) == (7 * 2 + 2 + 2 + 1, 1)  # the host waits to choose a branch
    assert counted(PROGRAM.replace(", TURNS", "")) == (2 + 2 + 2 + 1, 2)  # and for the loop's end


def test_a_folder_without_the_wheels_is_named(tmp_path, capsys):
    assert main(["--cuda", str(tmp_path), "--json", str(tmp_path / "out.json")]) == 2
    assert "--cuda: no jax_plugins in" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(WHEELS is None, reason="CUDA's wheels are not here")
def test_programs_for_an_h200_are_as_stored(tmp_path):
    made = tmp_path / "made.json"
    arguments = ["--cuda", WHEELS, "--sides", "316", "--sides-3d", "46", "--lowerings", "tiles"]
    assert main([*arguments, "--json", str(made)]) == 0

    def rows(path):
        key = ("dim", "particles", "lowering", "program")
        return {tuple(r[k] for k in key): r for r in json.loads(path.read_text())["rows"]}

    stored = rows(STORED)
    for case, row in rows(made).items():
        # not spilled bytes: the gradient in three dimensions had 8 and 136 in two compilations
        for figure in ("operations", "waits", "temporary_bytes", "registers"):
            assert row[figure] <= ROOM * stored[case][figure], (case, figure)
