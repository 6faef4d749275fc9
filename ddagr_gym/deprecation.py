"""Public names that moved: they go on working, with a DeprecationWarning that says the new name and until when.

A name inside a module::

    __getattr__ = renamed(__name__, {"old": "ddagr_gym.new_module:new"}, goes="0.4.0")

A whole module, in the table :data:`MOVED_MODULES`; :func:`install` makes the imports of its old name work.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

MOVED_MODULES: Mapping[str, tuple[str, str]] = {
    "ddagr_gym.replay.arm": ("ddagr_gym.replay_analysis.drive_mode", "0.4.0"),
    "ddagr_gym.replay.model": ("ddagr_gym.identification.window_model", "0.4.0"),
    "ddagr_gym.replay.noise": ("ddagr_gym.identification.recording_noise", "0.4.0"),
    "ddagr_gym.replay.parameters": ("ddagr_gym.identification.parameters", "0.4.0"),
    "ddagr_gym.replay.pieces": ("ddagr_gym.identification.timing_repair", "0.4.0"),
    "ddagr_gym.replay.split": ("ddagr_gym.identification.data_split", "0.4.0"),
    "ddagr_gym.replay.windows": ("ddagr_gym.identification.windows", "0.4.0"),
    "ddagr_gym.replay": ("ddagr_gym.replay_analysis", "0.4.0"),
    "ddagr_gym.diagnosis.verdict": ("ddagr_gym.diagnosis.result.files", "0.4.0"),
    "ddagr_gym.diagnosis.result.verdict": ("ddagr_gym.diagnosis.answer.verdict", "0.4.0"),
    "ddagr_gym.evaluation.arms": ("ddagr_gym.evaluation.policy_seeds", "0.4.0"),
}
"""Old name of a module or package -> its new name, and the release that removes the old one. The longest match
counts."""


def renamed(module: str, names: Mapping[str, str], goes: str) -> Callable[[str], Any]:
    """A module's ``__getattr__`` (PEP 562) for names that are elsewhere now.

    Args:
        module: name of the module that had them.
        names: old name -> "module:name" of the new one.
        goes: release in which the old names go.
    """

    def find(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        place, _, new = names[name].partition(":")
        _warn(f"{module}.{name}", f"{place}.{new}", goes)
        return getattr(importlib.import_module(place), new)

    return find


def install(moved: Mapping[str, tuple[str, str]] = MOVED_MODULES) -> None:
    """Make imports of moved modules work. Each warns once, when it is first imported.

    Args:
        moved: see :data:`MOVED_MODULES`.
    """
    sys.meta_path.insert(0, _MovedFinder(moved))


def _warn(old: str, new: str, goes: str) -> None:
    warnings.warn(f"{old} is {new} now; the old name goes in {goes}.", DeprecationWarning, stacklevel=3)


class _MovedFinder(MetaPathFinder):
    """Finds modules by their old names."""

    def __init__(self, moved: Mapping[str, tuple[str, str]]) -> None:
        self._moved = moved

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        for old in sorted(self._moved, key=len, reverse=True):
            if fullname == old or fullname.startswith(f"{old}."):
                new, goes = self._moved[old]
                if importlib.util.find_spec(new + fullname.removeprefix(old)) is None:
                    return None
                return ModuleSpec(fullname, _MovedLoader(old, new, goes), is_package=fullname == old)
        return None


class _MovedLoader(Loader):
    """Gives the module of the new name in place of the old one.

    The old package itself is a module apart: where a function of ``ddagr_gym`` has its name now, the package is set as
    the attribute that the function had, and passes calls on to it.
    """

    def __init__(self, old: str, new: str, goes: str) -> None:
        self._old, self._new, self._goes = old, new, goes

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        if spec.name == self._old:
            return _MovedPackage(spec.name, self._new)
        return ModuleType(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        new = self._new + module.__name__.removeprefix(self._old)
        _warn(module.__name__, new, self._goes)
        if not isinstance(module, _MovedPackage):
            sys.modules[module.__name__] = importlib.import_module(new)


class _MovedPackage(ModuleType):
    """A package by its old name: attributes are those of the new one, a call is one of the function of that name."""

    def __init__(self, name: str, new: str) -> None:
        super().__init__(name, f"Moved to {new}.")
        self._new = new

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(importlib.import_module(self._new), name)

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Call the function of ``ddagr_gym`` whose place the package has taken."""
        package, _, name = self.__name__.rpartition(".")
        found = sys.modules[package].__getattr__(name)
        setattr(sys.modules[package], name, found)
        return found(*arguments, **options)
