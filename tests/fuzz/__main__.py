"""`python -m fuzz`: damaged inputs for every reader, a line for each. Exit status 1 if a rule was broken.

make fuzz
make fuzz FUZZ="--reader journal --inputs 100000 --seed 7"
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from fuzz.campaign import fuzz, keep
from fuzz.readers import READERS


def main() -> int:
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    parser.add_argument("--reader", action="append", choices=sorted(READERS), help="only these; may be repeated")
    parser.add_argument("--inputs", type=int, help="for each reader; by default 20,000, or 500 for worlds and bags")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first input, to go on from there")
    parser.add_argument("--keep", type=Path, default=Path("fuzz-found"), help="folder for inputs that break a rule")
    asked = parser.parse_args()
    faults = 0
    for name in asked.reader or READERS:
        begin = time.monotonic()
        found = fuzz(name, asked.seed, asked.first, asked.inputs or READERS[name].inputs)
        counts = ", ".join(f"{found.counts[kind]} {kind}" for kind in ("read", "refused", "fault"))
        seconds = time.monotonic() - begin
        print(f"{name}: {found.inputs} inputs in {seconds:.0f} s: {counts}; slowest {found.slowest:.1f} s", flush=True)
        seen = set()
        for number, words in found.faults:
            if words.rpartition(" at ")[2] not in seen:
                seen.add(words.rpartition(" at ")[2])
                print(f"  {number}: {words}\n    kept in {keep(name, asked.seed, number, asked.keep)}", flush=True)
        faults += len(found.faults)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
