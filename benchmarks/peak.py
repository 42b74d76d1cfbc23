"""The peak of this core: multiply-adds a nanosecond, by the number of chains that does most."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("peak", __doc__)

import ctypes
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from benchmarks.peers import build

SOURCE = Path(__file__).parent / "native" / "peak.c"
CHAINS = (8, 10, 12, 16, 24)


def peaks(folder: Path) -> list[dict]:
    """Flops a nanosecond of one core, multiply-adds counted twice, of each number of independent
    chains; the best is the peak.

    Scalars take the time of vectors, so their peak is the vectors' over the lanes.
    """
    rates, lanes = chain_rates()
    row: dict = {f"{chains} chains": rate for chains, rate in rates.items()}
    chains, vector = best_chains(rates)
    return [row | {"best": f"{chains} chains", "scalar_gf": vector / lanes, "vector_gf": vector}]


def peak() -> tuple[float, float]:
    """Return flops per nanosecond of this core: of scalars, of vectors."""
    rates, lanes = chain_rates()
    _, vector = best_chains(rates)
    return vector / lanes, vector


def best_chains(rates: Mapping[int, float]) -> tuple[int, float]:
    """Return the number of chains that does most, and its rate; of equals the fewest chains."""
    return max(rates.items(), key=lambda item: (item[1], -item[0]))


@cache
def chain_rates() -> tuple[dict[int, float], int]:
    """Return flops a nanosecond for each number of chains, and how many doubles a vector holds."""
    library = ctypes.CDLL(str(build.build_library(SOURCE, build.CACHE)))
    library.measure_peak.restype = ctypes.c_double
    lanes = ctypes.c_int()
    rates = {chains: library.measure_peak(chains, ctypes.byref(lanes)) for chains in CHAINS}
    return rates, lanes.value
