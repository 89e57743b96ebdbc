"""Hard cases, their bounds and what judges a run: for `benchmarks.stability` and for the tests."""
