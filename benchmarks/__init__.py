"""Benchmarks: `python -m benchmarks.NAME`, run from the root of the repository."""
