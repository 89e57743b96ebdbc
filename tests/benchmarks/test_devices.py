"""Bytes that devices send one another, as they are read in a compiled program."""

from benchmarks.devices import exchanged

PROGRAM = """
  %g = f64[6,10]{0,1} all-gather(%x), channel_id=1, dimensions={1}
  %r = (s32[], f32[4]{0}) all-reduce(%a, %b), to_apply=%sum
  ROOT %p = f64[3]{0} collective-permute-start(%y), source_target_pairs={{0,1}}
  %n = f64[100]{0} fusion(%g), kind=kLoop, calls=%fused
"""


def test_what_collectives_send_is_counted_by_type():
    assert exchanged(PROGRAM) == {"f64": 8 * (60 + 3), "s32": 4, "f32": 16}
    assert exchanged("  %n = f64[100]{0} fusion(%g), kind=kLoop") == {}
