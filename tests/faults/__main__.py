"""Draws faults and prints the verdict of each: `make faults N=200 SEED=22`."""

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tqdm import tqdm

from faults.plan import NAMED, draw
from faults.rig import Rig


def main() -> int:
    """Run the draws of a seed; return 1 if one of them is not safe."""
    parser = argparse.ArgumentParser(prog="faults", description=__doc__)
    parser.add_argument("-n", type=int, default=20, help="number of draws (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=22, help="seed (default: %(default)s)")
    parser.add_argument("--named", type=int, metavar="K",
                        help="the fault with this number in faults.plan.NAMED alone")
    options = parser.parse_args()
    faults = (draw(options.seed, options.n) if options.named is None
              else [NAMED[options.named]])
    unsafe, outcomes = 0, Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        rig = Rig(Path(folder))
        for fault in tqdm(faults, unit="draw"):
            verdict = rig.verdict(fault)
            why = verdict.wrong
            unsafe += bool(why)
            outcomes[verdict.outcome] += 1
            tqdm.write(f"{'UNSAFE: ' + why if why else 'safe'}: {verdict}")
    print(f"{len(faults) - unsafe} of {len(faults)} draws are safe;",
          ", ".join(f"{number} {name}" for name, number in sorted(outcomes.items())))
    return int(unsafe > 0)


if __name__ == "__main__":
    sys.exit(main())
