"""Results of finished steps in a folder, so that a diagnosis that was stopped goes on where it was.

A step's result is any tree of the package's frozen dataclasses, arrays, mappings, sequences, texts and numbers. It is
kept as JSON beside one archive of arrays, never as a pickle, with a hash over both: a step whose files are damaged is
done again. A folder of another key (other data, sources, thresholds or setting) is emptied.
"""

from __future__ import annotations

import dataclasses
import hashlib
import importlib
import json
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path, expanded, make_folder
from ddagr_gym.physics.effects.base import Effect, build_effect
from ddagr_gym.physics.effects.registry import effect_kind
from ddagr_gym.tasks.store import Kept

Result = TypeVar("Result")

_KEY = "key.txt"
_PACKAGE = __name__.split(".", 1)[0]


class StepCache(Protocol):
    """Where results of steps are looked up by name before they are computed: :meth:`StepStore.step`, or nowhere."""

    def __call__(self, name: str, work: Callable[[], Result]) -> Result:
        """Result of a step: the kept one, or that of ``work``."""


def compute_without_cache(name: str, work: Callable[[], Result]) -> Result:
    """A :class:`StepCache` that keeps nothing."""
    return work()


class StepStore:
    """A folder of finished steps.

    Args:
        folder: made where it is absent; None keeps nothing.
        key: of everything that the steps depend on.
        progress: called with a line of text for each step that is done again, since its files are damaged.

    Raises:
        InputError: the folder holds something else.
    """

    def __init__(self, folder: Path | None, key: str, progress: Callable[[str], None] = lambda line: None) -> None:
        folder = None if folder is None else expanded(folder)
        self.folder, self._progress = folder, progress
        self._read: dict[str, Kept] = {}
        if folder is None:
            return
        if folder.exists() and any(folder.iterdir()) and not (folder / _KEY).is_file():
            raise InputError(f"{folder} holds files of something else: move it away or choose another --output.")
        if folder.exists() and (folder / _KEY).is_file() and (folder / _KEY).read_bytes() != key.encode():
            shutil.rmtree(folder)
        make_folder(folder)
        with atomic_path(folder / _KEY) as part:
            part.write_text(key)

    def has(self, name: str) -> bool:
        """Whether the step is finished and its files are whole; what is read for it serves the next :meth:`find`."""
        kept = self.find(name)
        if kept is not None:
            self._read[name] = kept
        return kept is not None

    def find(self, name: str) -> Kept | None:
        """The result of a finished step; None where there is none.

        Damaged files are removed, and a line of progress says so.
        """
        if name in self._read:
            return self._read.pop(name)
        if self.folder is None or not (self.folder / f"{name}.json").is_file():
            return None
        try:
            return Kept(_load(self.folder, name))
        except _DamagedError as damage:
            self._progress(f"{self.folder / name}.json, a finished step, is damaged ({damage}): it is done again")
            _remove(self.folder, name)
            return None

    def step(self, name: str, work: Callable[[], Result]) -> Result:
        """Result of a step: the kept one, or that of ``work``, which is kept."""
        kept = self.find(name)
        if kept is None:
            return self.put(name, work())
        result: Result = kept.value
        return result

    def put(self, name: str, result: Result) -> Result:
        """Keep the result of a step, and give it back."""
        self._read.pop(name, None)
        if self.folder is not None:
            _save(self.folder, name, result)
        return result

    def clear(self) -> None:
        """Remove the folder."""
        self._read.clear()
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


class _DamagedError(Exception):
    """Files of a step are not as they were written; says why."""


def _save(folder: Path, name: str, value: Any) -> None:
    arrays: dict[int, tuple[str, NDArray[Any]]] = {}
    text = json.dumps(encode(value, arrays))
    with atomic_path(folder / f"{name}.npz") as part:
        with open(part, "wb") as stream:
            np.savez(stream, **dict(arrays.values()))  # type: ignore[arg-type]
        digest = _digest(text, part)
    # the JSON marks the step as finished, and comes last
    with atomic_path(folder / f"{name}.json") as part:
        part.write_text(f'{{"sha256": "{digest}", "result": {text}}}')


def _load(folder: Path, name: str) -> Any:
    """Result of a step; _DamagedError where its files are not as they were written."""
    archive_path = folder / f"{name}.npz"
    try:
        content = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
        tree, expected = content["result"], content["sha256"]
        if _digest(json.dumps(tree), archive_path) != expected:
            raise _DamagedError("its hash is another one")
    except (OSError, ValueError, RecursionError, KeyError, TypeError) as error:
        raise _DamagedError(_reason(error)) from None
    with np.load(archive_path, allow_pickle=False) as archive:
        return decode(tree, {key: archive[key] for key in archive.files})


def _digest(text: str, archive: Path) -> str:
    """SHA-256 over the JSON of a result and the archive of its arrays."""
    with open(archive, "rb") as stream:
        arrays = hashlib.file_digest(stream, "sha256").hexdigest()
    return hashlib.sha256(f"{arrays} {text}".encode()).hexdigest()


def _reason(error: Exception) -> str:
    if isinstance(error, KeyError | TypeError):
        return "it has no result with a hash"
    return "it is nested too deeply" if isinstance(error, RecursionError) else str(error)


def _remove(folder: Path, name: str) -> None:
    for suffix in ("json", "npz"):
        (folder / f"{name}.{suffix}").unlink(missing_ok=True)


def encode(value: Any, arrays: dict[int, tuple[str, NDArray[Any]]]) -> Any:
    """Tree of JSON values; arrays go to ``arrays`` by identity, so that a shared one is kept once."""
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, int | float):
        return value
    if isinstance(value, np.ndarray):
        key, _ = arrays.setdefault(id(value), (f"array_{len(arrays)}", value))
        return {"array": key}
    if isinstance(value, Effect):
        return {"effect": value.as_mapping()}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {item.name: encode(getattr(value, item.name), arrays) for item in dataclasses.fields(value)}
        return {"class": f"{type(value).__module__}:{type(value).__qualname__}", "fields": fields}
    if isinstance(value, Mapping):
        return {"items": [[encode(k, arrays), encode(v, arrays)] for k, v in value.items()]}
    if isinstance(value, tuple | list):
        return {"tuple" if isinstance(value, tuple) else "list": [encode(item, arrays) for item in value]}
    raise TypeError(f"a step's result holds a {type(value).__name__}, which has no form on disk")


def decode(tree: Any, arrays: Mapping[str, NDArray[Any]]) -> Any:
    """Value of a tree that :func:`encode` made."""
    if not isinstance(tree, dict):
        return tree
    ((kind, content), *rest) = tree.items()
    if kind == "array":
        return arrays[content]
    if kind == "effect":
        return build_effect(effect_kind(content["name"]), content["parameters"])
    if kind == "class":
        return _dataclass(content)(**{name: decode(item, arrays) for name, item in rest[0][1].items()})
    if kind == "items":
        return {decode(key, arrays): decode(item, arrays) for key, item in content}
    made = [decode(item, arrays) for item in content]
    return tuple(made) if kind == "tuple" else made


def _dataclass(name: str) -> type[Any]:
    module, _, qualified = name.partition(":")
    if module.split(".", 1)[0] != _PACKAGE:
        raise TypeError(f"{name} is no class of this package")
    found: Any = importlib.import_module(module)
    for part in qualified.split("."):
        found = getattr(found, part)
    if not (isinstance(found, type) and dataclasses.is_dataclass(found)):
        raise TypeError(f"{name} is no dataclass")
    return found


def part_folder(output: Path) -> Path:
    """Where the steps of a diagnosis that ends up in ``output`` are kept meanwhile."""
    return output.with_name(f"{output.name}.part")
