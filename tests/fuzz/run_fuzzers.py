# SPDX-License-Identifier: BSD-3-Clause
"""Looks for inputs that break something: each libFuzzer program for a time, then
the Hypothesis tests of this folder for as long, with other examples each time.

python tests/fuzz/run_fuzzers.py BUILD_FOLDER [--seconds 60] [--seed 1]

What is new in coverage goes to out/fuzz/TARGET, what breaks something to
out/fuzz/TARGET-found, with the command that repeats it. Exit status 1 if there is
any.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
TARGETS = sorted(path.name for path in (HERE / "corpus").iterdir())
EXAMPLES = 300  # Of each Hypothesis test at a time.


def fuzz(program: Path, target: str, out: Path, seconds: int, seed: int) -> list[str]:
    """Run a libFuzzer program; return commands that repeat what it found."""
    new, found = out / target, out / f"{target}-found"
    for folder in (new, found):
        folder.mkdir(parents=True, exist_ok=True)
    before = set(found.iterdir())
    options = {
        "max_total_time": seconds,
        "seed": seed,
        "max_len": 4000,
        "len_control": 0,
        "timeout": 20,
        "rss_limit_mb": 2000,
        "malloc_limit_mb": 500,
        "print_final_stats": 1,
        "verbosity": 1,
        "artifact_prefix": f"{found}/",
    }
    command = [program, *(f"-{key}={value}" for key, value in options.items())]
    status = subprocess.run([*command, new, HERE / "corpus" / target]).returncode
    files = sorted(set(found.iterdir()) - before)
    commands = [f"{program} {path}" for path in files]
    return commands or [f"{program} ended with status {status}"] * (status != 0)


def try_examples(seconds: int, seed: int) -> list[str]:
    """Run the Hypothesis tests; return commands that repeat what they found."""
    end = time.monotonic() + seconds
    environment = {**os.environ, "DUAL_PROXY_FUZZ_EXAMPLES": str(EXAMPLES)}
    while True:
        options = ["-q", f"--hypothesis-seed={seed}", str(HERE)]
        command = [sys.executable, "-m", "pytest", *options]
        if subprocess.run(command, env=environment).returncode != 0:
            examples = f"DUAL_PROXY_FUZZ_EXAMPLES={EXAMPLES}"
            return [f"{examples} {' '.join(command)}"]
        if time.monotonic() > end:
            return []
        seed += 1


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("build", type=Path)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"))
    options = parser.parse_args()
    found = []
    for target in TARGETS:
        print(f"fuzz {target}", flush=True)
        program = options.build / "tests" / "fuzz" / f"{target}_fuzz"
        found += fuzz(program, target, options.out, options.seconds, options.seed)
    print("hypothesis", flush=True)
    found += try_examples(options.seconds, options.seed)
    print("\nfound, to be repeated by" if found else "\nnothing found")
    print("\n".join(found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
