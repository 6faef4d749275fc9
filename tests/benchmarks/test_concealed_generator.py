"""The blind benchmark's protocol: what a set holds, determinism, commitments, independence of the package."""

from __future__ import annotations

import ast
import collections
import gzip
import json
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.concealed import cases, catalogue, commitments, generate, manoeuvres, sensors, simulate, storage
from benchmarks.concealed.sizes import LEAST_MEANINGFUL
from benchmarks.concealed.streams import stream

SEED = 11
SLOW_AND_FAST = (lambda speed: speed < 0.02, lambda speed: speed > 1.2)
ALLOWED_IMPORTS = {"numpy", "scipy", "numba"}


@pytest.fixture(scope="module")
def folder(repository: Path) -> Path:
    return repository / "benchmarks" / "concealed"


@pytest.fixture
def short_drives(monkeypatch):
    """Drives of 8 s, so that whole cases are made in a moment; the protocol does not depend on their length."""
    monkeypatch.setattr(manoeuvres, "DURATION", 8.0)


@pytest.fixture(scope="module")
def sealed(tmp_path_factory) -> tuple[Path, Path]:
    """(data folder, labels file) of the first three cases of a sealed set, in drives of 8 s."""
    data = tmp_path_factory.mktemp("sealed") / "set"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(manoeuvres, "DURATION", 8.0)
        return data, generate.generate("sealed", SEED, data, processes=1, limit=3)


@pytest.fixture
def sealed_copy(sealed, tmp_path) -> tuple[Path, Path]:
    """A copy that may be tampered with."""
    data, labels = sealed
    shutil.copytree(data, tmp_path / "set")
    return tmp_path / "set", Path(shutil.copy(labels, tmp_path / "labels.json"))


def everything_in(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.mark.parametrize(("set_name", "doubles"), [("development", 10), ("sealed", 10), ("ninth", 14)])
def test_a_set_holds_what_the_protocol_says(set_name, doubles):
    planned = cases.plan(set_name, SEED)
    kinds = collections.Counter(case.kind for case in planned)
    assert kinds["null"] == kinds["structural null"] == 20
    assert kinds["double"] == doubles
    assert kinds["outside"] >= 15
    singles = [case for case in planned if case.kind == "single"]
    first = collections.Counter(case.verdict[0] for case in singles if not case.effects[0][0].later)
    assert first == dict.fromkeys(LEAST_MEANINGFUL, 2)
    assert all(case.structure for case in planned if case.kind == "structural null")
    assert {case.structure for case in planned if case.kind == "structural null"} == set(cases.STRUCTURES) - {""}
    assert [case.number for case in planned] == list(range(1, len(planned) + 1))
    for case in planned:
        for form, multiple in case.effects:
            assert form.low <= multiple <= form.high
            assert case.receiver or not form.needs_pose
    with_receiver = np.mean([case.receiver for case in planned])
    assert 0.65 < with_receiver < 0.95


def test_the_plan_is_printed_without_making_anything(capsys):
    assert generate.main(["--set", "sealed", "--plan"]) == 0
    printed = dict(line.rsplit(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    kinds = collections.Counter(case.kind for case in cases.plan("sealed", SEED))
    assert {kind: int(count) for kind, count in printed.items()} == {**kinds, "cases": 124}


def test_reserved_effects_and_pairs_stay_out_of_the_development_set():
    for seed in range(5):
        development, sealed_set = (cases.plan(name, seed) for name in ("development", "sealed"))
        assert not any(form.reserved for case in development for form, _ in case.effects)
        assert sum(form.reserved for case in sealed_set for form, _ in case.effects) >= 10
        pairs = {tuple(case.verdict) for case in development if case.kind == "double"}
        assert pairs <= set(catalogue.OPEN_PAIRS)


def test_the_order_tells_nothing():
    """Kinds are shuffled, differently for every seed."""
    orders = [[case.kind for case in cases.plan("sealed", seed)] for seed in (1, 2)]
    assert orders[0] != orders[1]
    assert len(set(orders[0][:12])) >= 3


def test_manoeuvres_noise_and_soil_do_not_depend_on_the_label(short_drives):
    null = next(case for case in cases.plan("development", SEED) if case.kind == "null" and case.receiver)
    form = catalogue.LIBRARY_FORMS["gyro_bias"][0]
    other = replace(null, kind="single", effects=((form, 5.0),))
    assert cases._complete(null, SEED).manoeuvres == cases._complete(other, SEED).manoeuvres
    plain, _ = simulate.simulate_case(null, SEED)
    biased, label = simulate.simulate_case(other, SEED)
    for run in manoeuvres.RUNS:
        np.testing.assert_array_equal(plain[run]["imu_ax"], biased[run]["imu_ax"])
        np.testing.assert_array_equal(plain[run]["x"], biased[run]["x"])
        shift = biased[run]["imu_gz"] - plain[run]["imu_gz"]
        np.testing.assert_allclose(shift, label["effects"][0]["parameters"]["bias"], atol=1e-12)
    assert label["difference"]["imu_gz"] == pytest.approx(5.0 * 1e-3 / 0.003, rel=0.01)
    assert label["difference"]["imu_ax"] == 0.0


def test_logged_commands_lead_or_accompany_the_wheels(short_drives):
    rows = {}
    for row in ("issued", "acting"):
        case = cases.Case("development", 1, "null", (), command_row=row)
        rows[row] = simulate.simulate_case(case, SEED)[0]["run_1"]
    np.testing.assert_array_equal(rows["acting"]["cmd_left"][1:], rows["issued"]["cmd_left"][:-1])
    np.testing.assert_array_equal(rows["acting"]["enc_left"], rows["issued"]["enc_left"])
    started = np.argmax(rows["issued"]["cmd_left"] != 0)
    assert np.all(np.abs(rows["issued"]["enc_left"][: started + 1]) < 0.02)
    assert {case.command_row for case in cases.plan("sealed", SEED)} == {"issued", "acting"}


def test_manoeuvres_are_what_their_names_say():
    for seed in range(cases.MANOEUVRE_SETS):
        straight, arcs, anything = (manoeuvres.programme(run, seed) for run in manoeuvres.RUNS)
        for commands in (straight, arcs, anything):
            assert commands.shape == (3000, 2)
            assert np.abs(commands).max() <= manoeuvres.FASTEST
            assert np.all(commands[[0, -1]] == 0.0)
        assert np.array_equal(straight[:, 0], straight[:, 1])
        assert np.mean(np.all(straight[100:] == 0.0, axis=1)) > 0.02
        assert np.mean(np.abs(arcs[:, 0] - arcs[:, 1]) > 0.05) > 0.4


def test_columns_and_noise_of_a_recording():
    case = cases.Case("development", 1, "null", ())
    logs, _ = simulate.simulate_case(case, SEED)
    shaken, speeds = [], []
    for log in logs.values():
        assert tuple(log) == sensors.COLUMNS
        assert all(len(values) == 3000 for values in log.values())
        np.testing.assert_allclose(np.diff(log["t"]), 0.02)
        assert np.array_equal(np.isfinite(log["x"]), np.arange(3000) % 10 == 0)
        counts = log["enc_right"] * sensors.COUNTS * 0.02 / (2.0 * np.pi)
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
        assert np.std(log["imu_gz"][:70]) == pytest.approx(0.003, rel=0.25)
        shaken.append(np.diff(log["imu_ay"]))
        speeds.append((np.abs(log["enc_right"]) + np.abs(log["enc_left"]))[1:])
    still, fast = (np.concatenate(shaken)[chosen(np.concatenate(speeds))] for chosen in SLOW_AND_FAST)
    assert np.std(fast) > 1.3 * np.std(still)


def test_csv_reads_back_with_the_columns_of_the_concealed_cases(sealed, shared_dir):
    data, _ = sealed
    text = gzip.decompress((data / "case_001" / "run_1.csv.gz").read_bytes()).decode().splitlines()
    assert tuple(text[0].split(",")) == sensors.COLUMNS
    documented = (shared_dir / "concealed" / "README.md").read_text()
    for name in ("imu_ax", "imu_ay", "imu_gz", "cmd_right", "enc_right", "yaw"):
        assert f"`{name}`" in documented
    assert all(line.count(",") == 10 for line in text)


def test_same_seed_same_bytes_and_another_seed_others(sealed, short_drives, tmp_path):
    data, labels = sealed
    again = generate.generate("sealed", SEED, tmp_path / "set", processes=1, limit=3)
    assert everything_in(tmp_path / "set") == everything_in(data)
    assert again.read_bytes() == labels.read_bytes()
    generate.generate("sealed", SEED + 1, tmp_path / "other", processes=1, limit=1)
    assert (tmp_path / "other/case_001/run_1.csv.gz").read_bytes() != (data / "case_001/run_1.csv.gz").read_bytes()


def test_an_interrupted_run_goes_on(sealed, short_drives, tmp_path, monkeypatch):
    data, labels = sealed
    made = []

    def failing(case, seed):
        if len(made) == 2:
            raise KeyboardInterrupt
        made.append(case.name)
        return simulate.simulate_case(case, seed)

    monkeypatch.setattr(generate, "simulate_case", failing)
    with pytest.raises(KeyboardInterrupt):
        generate.generate("sealed", SEED, tmp_path / "set", processes=1, limit=3)
    assert not (tmp_path / "set.labels.json").exists()
    monkeypatch.setattr(generate, "simulate_case", simulate.simulate_case)
    with pytest.raises(storage.BenchmarkError, match="another seed"):
        generate.generate("sealed", SEED + 1, tmp_path / "set", processes=1, limit=3)
    resumed = generate.generate("sealed", SEED, tmp_path / "set", processes=1, limit=3)
    assert everything_in(tmp_path / "set") == everything_in(data)
    assert resumed.read_bytes() == labels.read_bytes()


def test_a_worker_process_makes_the_same_set(tmp_path):
    """Full length: a worker process does not see the shortened drives."""
    for processes in (1, 2):
        generate.generate("development", SEED, tmp_path / str(processes), processes=processes, limit=1)
    assert everything_in(tmp_path / "1") == everything_in(tmp_path / "2")


def test_a_secret_seed_is_kept_with_the_labels_only(short_drives, tmp_path):
    labels = generate.generate("sealed", None, tmp_path / "set", processes=1, limit=1)
    seed = json.loads(labels.read_text())["seed"]
    assert seed > 2**64
    assert not any(str(seed).encode() in content for content in everything_in(tmp_path / "set").values())


def test_a_sealed_set_shows_no_label(sealed):
    data, labels = sealed
    published = json.loads((data / "commitments.json").read_text())
    assert not {"seed", "salt", "label", "verdict"} & set(published)
    assert all(set(entry) == {"label", "data"} for entry in published["cases"].values())
    assert sorted(p.name for p in data.iterdir()) == ["case_001", "case_002", "case_003", "commitments.json"]
    entry = json.loads(labels.read_text())["cases"]["case_001"]
    assert published["cases"]["case_001"]["label"] == commitments.commitment(entry["salt"], entry["label"])


def test_commitments_verify_and_replay(sealed, short_drives, capsys):
    data, labels = sealed
    assert commitments.discrepancies(data, labels, replay=1) == []
    assert commitments.main(["verify", "--data", str(data), "--labels", str(labels)]) == 0
    assert "agree" in capsys.readouterr().out


@pytest.mark.parametrize("what", ["verdict", "seed", "recording", "missing", "published"])
def test_tampering_is_found(sealed_copy, what, capsys):
    data, labels = sealed_copy
    opened, published = json.loads(labels.read_text()), json.loads((data / "commitments.json").read_text())
    if what == "verdict":
        opened["cases"]["case_002"]["label"]["verdict"] = ["payload", "slope"]
    elif what == "seed":
        opened["seed"] += 1
    elif what == "recording":
        file = data / "case_002" / "run_3.csv.gz"
        file.write_bytes(gzip.compress(gzip.decompress(file.read_bytes()).replace(b"0", b"1", 1)))
    elif what == "missing":
        del opened["cases"]["case_002"]
    else:
        published["cases"]["case_002"]["label"] = "0" * 64
    labels.write_text(json.dumps(opened))
    (data / "commitments.json").write_text(json.dumps(published))
    faults = commitments.discrepancies(data, labels)
    assert len(faults) >= 1
    assert ("seed" if what == "seed" else "case_002") in " ".join(faults)
    assert commitments.main(["verify", "--data", str(data), "--labels", str(labels)]) == 1
    assert commitments.main(["reveal", "--data", str(data), "--labels", str(labels)]) == 2
    assert not (data / "labels.json").exists()
    assert "not revealed" in capsys.readouterr().err


def test_commitments_are_held_against_the_published_copy(sealed_copy, tmp_path, capsys):
    """Commitments that were rewritten together with the labels agree with them, but not with what was published."""
    data, labels = sealed_copy
    published = Path(shutil.copy(data / "commitments.json", tmp_path / "published.json"))
    opened, rewritten = json.loads(labels.read_text()), json.loads(published.read_text())
    entry = opened["cases"]["case_002"]
    entry["label"]["verdict"] = ["payload", "slope"]
    rewritten["cases"]["case_002"]["label"] = commitments.commitment(entry["salt"], entry["label"])
    labels.write_text(json.dumps(opened))
    (data / "commitments.json").write_text(json.dumps(rewritten))
    words = ["verify", "--data", str(data), "--labels", str(labels)]
    assert commitments.main(words) == 0
    assert commitments.main([*words, "--commitments", str(published)]) == 1
    assert "case_002" in capsys.readouterr().out


def test_reveal_publishes_the_labels(sealed_copy):
    data, labels = sealed_copy
    assert commitments.main(["reveal", "--data", str(data), "--labels", str(labels)]) == 0
    assert json.loads((data / "labels.json").read_text()) == json.loads(labels.read_text())


def test_salts_cannot_be_told_from_labels():
    label = {"verdict": ["none"]}
    digests = {commitments.commitment(commitments.salt(SEED, f"case_{k:03d}"), label) for k in range(50)}
    assert len(digests) == 50


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--set", "sealed", "--seed", "1", "--labels", "OUT/labels.json"), "inside the sealed set"),
        (("--set", "ninth", "--seed", "1", "--labels", "OUT/labels.json"), "inside the ninth set"),
        (("--set", "development", "--seed", "1"), "is not empty"),
    ],
)
def test_command_line_refuses_in_one_sentence(tmp_path, capsys, arguments, sentence):
    (tmp_path / "foreign.txt").write_text("mine")
    arguments = [argument.replace("OUT", str(tmp_path)) for argument in arguments]
    assert generate.main([*arguments, "--output", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert sentence in error
    assert error.count("\n") == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["foreign.txt"]


@pytest.mark.parametrize("text", ["-3", "1.5", "abc"])
def test_bad_seed(text, tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        generate.main(["--set", "sealed", f"--seed={text}", "--output", str(tmp_path / "set")])
    assert stopped.value.code == 2
    assert "non-negative whole number" in capsys.readouterr().err


def test_streams_are_independent_by_name():
    draws = {name: stream(SEED, "sealed", 4, name).random() for name in ("soil", "noise", "effect", "plan")}
    assert len(set(draws.values())) == 4
    assert draws["soil"] == stream(SEED, "sealed", 4, "soil").random()


def test_nothing_of_the_package_is_imported(folder):
    """Import contract: only numpy, scipy, numba and the standard library, so that there is no inverse crime."""
    for file in folder.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module or ""]
            for name in names:
                top = name.split(".")[0]
                own = name == "benchmarks" or name.startswith("benchmarks.concealed")
                assert own or top in ALLOWED_IMPORTS or top in sys.stdlib_module_names, f"{file.name} imports {name}"
        assert "ddagr_gym" not in file.read_text().replace("ddagr_gym``", ""), file.name


def test_running_it_loads_nothing_of_the_package(repository):
    code = "import sys, benchmarks.concealed.generate; sys.exit(any(m.startswith('ddagr') for m in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], cwd=repository, check=False).returncode == 0


def test_readme_lists_every_form_and_size(folder):
    text = (folder / "README.md").read_text()
    for row in (*catalogue.form_rows(), *catalogue.size_rows()):
        assert row in text, f"README.md lacks the row {row!r}: run python -m benchmarks.concealed.catalogue"
