"""Labels that are fixed before anyone sees them: salted hashes, their verification and their opening.

``python -m benchmarks.concealed.commitments verify --data DIR --labels FILE [--commitments FILE] [--replay N]``
``python -m benchmarks.concealed.commitments reveal --data DIR --labels FILE [--commitments FILE]``

Labels and recordings are held against ``DIR/commitments.json``, or against the copy that was published before the run.
A label's commitment is SHA-256(salt || canonical JSON); the salt is an HMAC of the case's name under the seed, so that
neither a label nor a salt can be guessed without the seed, and the seed itself is committed to in the same way.
"""

from __future__ import annotations

import argparse
import hashlib
import hmac
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .cases import plan
from .simulate import simulate_case
from .storage import BenchmarkError, canonical, csv_bytes, digest, read_json, recording_digest, write_json


def salt(seed: int, name: str) -> str:
    """Salt of a case (or of the seed itself, by the name "seed") in hexadecimal."""
    return hmac.new(str(seed).encode(), name.encode(), hashlib.sha256).hexdigest()


def commitment(salt_hex: str, label: Any) -> str:
    """SHA-256 of a salt and a label."""
    return digest(bytes.fromhex(salt_hex) + canonical(label))


def _public(header: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in header.items() if key != "seed"}


def committed(header: Mapping[str, Any], entries: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """What may be published before the run: no label, no seed, no salt.

    Args:
        header: of the set, with its seed.
        entries: {case: {"label": ..., "data": {run: SHA-256}}}.
    """
    seed = int(header["seed"])
    cases = {
        name: {"label": commitment(salt(seed, name), entry["label"]), "data": entry["data"]}
        for name, entry in entries.items()
    }
    return {**_public(header), "seed_commitment": commitment(salt(seed, "seed"), seed), "cases": cases}


def discrepancies(data: Path, labels_file: Path, replay: int = 0, published_file: Path | None = None) -> list[str]:
    """Everything in which labels, recordings and commitments disagree; empty if all is in order.

    Args:
        data: folder of a sealed set, with ``commitments.json``.
        labels_file: labels with seed and salts.
        replay: cases that are generated anew from the seed and compared with label and recordings.
        published_file: commitments that were published; those in the folder by default.
    """
    published, opened = read_json(published_file or data / "commitments.json"), read_json(labels_file)
    seed, faults = int(opened["seed"]), []
    if commitment(salt(seed, "seed"), seed) != published["seed_commitment"]:
        faults.append("the seed is not the one committed to")
    for name in sorted(set(published["cases"]) ^ set(opened["cases"])):
        faults.append(f"{name} is only in one of commitments and labels")
    for name, entry in published["cases"].items():
        label = opened["cases"].get(name, {}).get("label")
        if label is not None and commitment(salt(seed, name), label) != entry["label"]:
            faults.append(f"{name}: the label is not the one committed to")
        for run, expected in entry["data"].items():
            if recording_digest(data / name / f"{run}.csv.gz") != expected:
                faults.append(f"{name}/{run}: the recording is not the one committed to")
    return faults + _replayed(published, opened, replay)


def _replayed(published: Mapping[str, Any], opened: Mapping[str, Any], count: int) -> list[str]:
    """Discrepancies of the first ``count`` cases when they are generated anew."""
    faults, seed = [], int(opened["seed"])
    for case in plan(published["set"], seed)[:count]:
        logs, label = simulate_case(case, seed)
        if canonical(label) != canonical(opened["cases"][case.name]["label"]):
            faults.append(f"{case.name}: the label is not the one that the seed gives")
        if {run: digest(csv_bytes(log)) for run, log in logs.items()} != published["cases"][case.name]["data"]:
            faults.append(f"{case.name}: the recordings are not the ones that the seed gives")
    return faults


def reveal(data: Path, labels_file: Path, published_file: Path | None = None) -> Path:
    """Copy verified labels to ``data/labels.json``; refuse when anything disagrees."""
    faults = discrepancies(data, labels_file, published_file=published_file)
    if faults:
        raise BenchmarkError(f"not revealed: {faults[0]} ({len(faults)} discrepancies); find their cause first.")
    opened, target = read_json(labels_file), data / "labels.json"
    write_json(target, opened)
    return target


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="benchmarks.concealed.commitments", description=__doc__)
    parser.add_argument("action", choices=("verify", "reveal"))
    parser.add_argument("--data", type=Path, required=True, help="folder of the sealed set")
    parser.add_argument("--labels", type=Path, required=True, help="file with the labels")
    parser.add_argument("--commitments", type=Path, help="published commitments; default: those in the folder")
    parser.add_argument("--replay", type=int, default=0, help="cases to generate anew and compare")
    return parser


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit code."""
    options = _parser().parse_args(arguments)
    try:
        if options.action == "reveal":
            print(f"revealed: {reveal(options.data, options.labels, options.commitments)}")
            return 0
        faults = discrepancies(options.data, options.labels, options.replay, options.commitments)
    except BenchmarkError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print("\n".join(faults) if faults else "labels, recordings and commitments agree")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
