"""Draws faults and prints the verdict of each: `make faults N=200 SEED=22`.

N faults of any kind happen in a hit, N things that people do or silent topics in a passage, and N
deaths of the part that moves the robot, N stops and N silences of the driver in a hit, a walk and a
passage. The joints follow the rules of ros2_control's controller (controller_double.py).
"""

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tqdm import tqdm

from faults.plan import FRICTIONS, HIT, NAMED, PASSAGE, WALK, draw, in_passage, outages
from faults.rig import Rig

MOTIONS = ((HIT, FRICTIONS[0]), (WALK, FRICTIONS[0]), *(
    (PASSAGE, friction) for friction in FRICTIONS))
"""Motions, and the friction of the soles in each."""


def main() -> int:
    """Run the draws of a seed; return 1 if one of them is not safe."""
    parser = argparse.ArgumentParser(prog="faults", description=__doc__)
    parser.add_argument("-n", type=int, default=20, help="number of draws (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=22, help="seed (default: %(default)s)")
    parser.add_argument("--named", type=int, metavar="K",
                        help="the fault with this number in faults.plan.NAMED alone")
    options = parser.parse_args()
    runs, safe, stood = Counter[str](), Counter[str](), Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        for motion, friction in MOTIONS if options.named is None else MOTIONS[:1]:
            rig = Rig(Path(folder), motion, friction)
            drawn = outages(motion, rig.lasts, options.seed, options.n)
            if motion == PASSAGE:
                drawn += in_passage(rig.lasts, options.seed, options.n)
                drawn = drawn[FRICTIONS.index(friction)::len(FRICTIONS)]
            faults = [(f"{motion}, {fault.part} {fault.kind}", fault) for fault in drawn]
            if options.named is not None:
                faults = [("hit, named", NAMED[options.named])]
            elif motion == HIT:
                faults += [("hit, any fault", fault) for fault in draw(options.seed, options.n)]
            for group, fault in tqdm(sorted(faults, key=lambda each: each[1].begin), unit="draw"):
                verdict = rig.verdict(fault)
                why = verdict.wrong
                runs[group] += 1
                safe[group] += not why
                stood[group] += not verdict.fell
                tqdm.write(f"{'UNSAFE: ' + why if why else 'safe'}: friction {friction}: {verdict}")
    for group, number in sorted(runs.items()):
        print(f"{group}: of {number} draws {safe[group]} are safe; {stood[group]} stood")
    return int(safe != runs)


if __name__ == "__main__":
    sys.exit(main())
