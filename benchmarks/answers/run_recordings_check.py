"""Write what ``ddagr check`` says about every concealed real drive to ``recordings_check.json`` beside this file.

The drives are read from DDAGR_RECORDINGS, else from ``recordings`` of DDAGR_SHARED, else from ``shared/recordings``
beside the checkout. The thresholds were set on the open drives and on simulated ones; nothing here is edited by hand.

    python benchmarks/answers/run_recordings_check.py
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

import numpy as np

from ddagr_gym import __version__
from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.recordings.load import load_recording

HERE = Path(__file__).resolve().parent
SEED = 0


def recordings_folder() -> Path:
    shared = Path(os.environ.get("DDAGR_SHARED") or HERE.parents[2] / "shared")
    return Path(os.environ.get("DDAGR_RECORDINGS") or shared / "recordings")


def answer(path: Path) -> dict[str, object]:
    start = time.perf_counter()
    recording = load_recording(path, robot=path.name.split("_", 1)[0])
    report = check_recording(recording, np.random.default_rng(SEED))
    found = report.suspicious
    print(f"{path.name}: {', '.join(f'{f.check} {f.channel}' for f in found) or 'nothing suspicious'}")
    return {
        **report.to_json(),
        "suspects": sorted({name for f in found for name in f.suspects}),
        "not_testable": [f"{f.check}: {f.channel}" for f in report.findings if f.status is Status.NOT_TESTABLE],
        "version": __version__,
        "computing_seconds": round(time.perf_counter() - start, 3),
    }


def main() -> int:
    paths = sorted((recordings_folder() / "concealed").glob("*.csv.gz"))
    if not paths:
        print(f"no recordings in {recordings_folder()}/concealed: set DDAGR_RECORDINGS", file=sys.stderr)
        return 2
    answers = {path.name.split(".", 1)[0]: answer(path) for path in paths}
    text = json.dumps(answers, indent=1, allow_nan=False) + "\n"
    write_atomically(HERE / "recordings_check.json", lambda to: to.write_text(text, encoding="utf-8"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
