"""Runs sensel's sweeps on Dask, and searches for designs with batches of a sweep's cells."""

from .command_line import main

__all__ = ["main"]
