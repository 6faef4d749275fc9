"""Policies as files: what is written is read back, what is hostile is refused in one sentence."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.number_files import MAXIMUM_BYTES, MAXIMUM_UNPACKED
from ddagr_gym.policies.archive import Policy, load_policy, save_policy
from ddagr_gym.policies.design import PolicyDesign

DESIGN = PolicyDesign()
SIZE = len(DESIGN.inputs)


def make_policy(design=DESIGN, units=8, seed=0, **others):
    rng = np.random.default_rng(seed)
    inputs = len(design.inputs)
    shapes = [(units, inputs), (units, units), (2, units)]
    return Policy(
        design=design,
        weights=tuple(rng.normal(0, 0.3, shape).astype(np.float32) for shape in shapes),
        biases=tuple(rng.normal(0, 0.1, shape[0]).astype(np.float32) for shape in shapes),
        mean=rng.normal(size=inputs),
        deviation=rng.uniform(0.5, 2.0, inputs),
        training={"algorithm": "ppo", "seed": 3, "steps": 10, "digest": "ab", "version": "0"},
        **others,
    )


def write_arrays(path, arrays):
    with path.open("wb") as file:
        np.savez(file, **arrays)


@pytest.fixture
def stored(tmp_path):
    """A policy's file, and its members."""
    file = save_policy(make_policy(), tmp_path / "policy.npz")
    with np.load(file) as archive:
        return file, {name: archive[name] for name in archive.files}


@pytest.mark.parametrize(
    "design", [PolicyDesign(), PolicyDesign(features="raw", frames=3), PolicyDesign(action="absolute")]
)
@pytest.mark.parametrize("squashed", [False, True])
def test_what_was_saved_is_read_back(tmp_path, design, squashed):
    policy = make_policy(design, squashed=squashed, activation="relu", clip=5.0)
    again = load_policy(save_policy(policy, tmp_path / "policy.npz"))
    assert (again.design, again.clip, again.activation, again.squashed) == (design, 5.0, "relu", squashed)
    assert again.training == policy.training
    inputs = np.random.default_rng(1).normal(size=(7, len(design.inputs))).astype(np.float32)
    np.testing.assert_array_equal(policy(inputs), again(inputs))
    assert again(inputs).shape == (7, 2)
    assert (np.abs(again(inputs)).max() <= 1.0) or not squashed


def test_outputs_are_those_of_the_formula():
    policy = make_policy(units=4)
    x = np.random.default_rng(2).normal(size=len(policy.design.inputs))
    layer = np.clip((x - policy.mean) / policy.deviation, -10, 10)
    for weight, bias in zip(policy.weights[:2], policy.biases[:2], strict=True):
        layer = np.tanh(weight.astype(float) @ layer + bias)
    np.testing.assert_allclose(
        policy(x[None])[0], policy.weights[2].astype(float) @ layer + policy.biases[2], rtol=1e-5
    )


def test_missing_and_foreign_files(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        load_policy(tmp_path / "none.npz")
    for name, content in {"text": b"hello", "empty": b"", "broken": b"PK\x03\x04" + bytes(50)}.items():
        (tmp_path / f"{name}.npz").write_bytes(content)
        with pytest.raises(InputError, match="not a policy"):
            load_policy(tmp_path / f"{name}.npz")


def test_a_cut_file_is_refused(stored):
    file, _ = stored
    content = file.read_bytes()
    for share in (0.2, 0.5, 0.9):
        file.write_bytes(content[: int(share * len(content))])
        with pytest.raises(InputError, match="not a policy"):
            load_policy(file)


class Bomb:
    """Unpickling it would run code."""

    def __reduce__(self):
        return (pytest.fail, ("a policy file was unpickled",))


def test_pickled_objects_are_not_loaded(stored):
    file, arrays = stored
    arrays["mean"] = np.array([Bomb()], dtype=object)
    with file.open("wb") as opened:
        np.savez(opened, allow_pickle=True, **arrays)
    with pytest.raises(InputError, match="not a policy"):
        load_policy(file)


def test_large_files_are_not_loaded(stored, tmp_path):
    file, arrays = stored
    write_arrays(file, arrays | {"weight_9": np.random.default_rng(0).normal(size=MAXIMUM_BYTES // 8)})
    with pytest.raises(InputError, match="at most"):
        load_policy(file)
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("mean.npy", bytes(MAXIMUM_UNPACKED + 1))
    assert file.stat().st_size < MAXIMUM_BYTES
    with pytest.raises(InputError, match="unpacks"):
        load_policy(file)


def test_a_header_that_promises_too_much_is_refused(stored):
    file, arrays = stored
    member = io.BytesIO()
    np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": (10**12,)})
    write_arrays(file, {name: value for name, value in arrays.items() if name != "mean"})
    with zipfile.ZipFile(file, "a") as archive:
        archive.writestr("mean.npy", member.getvalue())
    with pytest.raises(InputError):
        load_policy(file)


@pytest.mark.parametrize(
    ("name", "value", "complaint"),
    [
        ("mean", np.zeros(3), "shape"),
        ("mean", np.zeros(SIZE, dtype=np.float32), "float32"),
        ("weight_0", np.zeros((8, 3), dtype=np.float32), "shape"),
        ("weight_1", np.full((8, 8), np.nan, dtype=np.float32), "not finite: give a policy of another training"),
        ("bias_2", np.zeros(3, dtype=np.float32), "shape"),
        ("deviation", np.zeros(SIZE), "positive"),
        ("more", np.zeros(3), "'more'"),
        ("description", np.frombuffer(b"[", dtype=np.uint8), "JSON"),
        ("description", np.frombuffer(b"7", dtype=np.uint8), "JSON"),
        ("description", np.frombuffer(b'{"format": 99}', dtype=np.uint8), "99"),
        ("description", np.zeros(3), "description"),
    ],
)  # fmt: skip
def test_members_that_do_not_fit(stored, name, value, complaint):
    file, arrays = stored
    write_arrays(file, arrays | {name: value})
    with pytest.raises(InputError, match=complaint):
        load_policy(file)


@pytest.mark.parametrize("name", ["mean", "weight_1", "bias_0", "description"])
def test_members_that_are_missing(stored, name):
    file, arrays = stored
    del arrays[name]
    write_arrays(file, arrays)
    with pytest.raises(InputError):
        load_policy(file)


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d.update(outputs=3),
        lambda d: d.update(clip=0.0),
        lambda d: d.update(activation="gelu"),
        lambda d: d.update(surprise=1),
        lambda d: d["inputs"].reverse(),
        lambda d: d["design"].update(frames=2),
        lambda d: d["design"].update(frames=10**9),
        lambda d: d["design"].update(rate_limit=-1.0),
        lambda d: d["training"].pop("seed"),
    ],
)
def test_descriptions_that_do_not_fit(stored, change):
    file, arrays = stored
    described = json.loads(arrays["description"].tobytes())
    change(described)
    arrays["description"] = np.frombuffer(json.dumps(described).encode(), dtype=np.uint8)
    write_arrays(file, arrays)
    with pytest.raises(InputError):
        load_policy(file)


def test_layouts_of_another_version_are_named(stored):
    file, arrays = stored
    described = json.loads(arrays["description"].tobytes())
    described["inputs"][4] = "encoder_middle"
    arrays["description"] = np.frombuffer(json.dumps(described).encode(), dtype=np.uint8)
    write_arrays(file, arrays)
    with pytest.raises(InputError, match="inputs are not those"):
        load_policy(file)


def test_same_policy_same_bytes(tmp_path):
    first, second = (save_policy(make_policy(), tmp_path / name) for name in ("a.npz", "b.npz"))
    assert first.read_bytes() == second.read_bytes()
    other = save_policy(replace(make_policy(), clip=3.0), tmp_path / "c.npz")
    assert other.read_bytes() != first.read_bytes()
