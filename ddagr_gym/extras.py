"""Which extra of the package brings a library, for the sentence when it is absent."""

from __future__ import annotations

import shlex
import sys
from importlib.util import find_spec
from pathlib import Path

from ddagr_gym.errors import InputError

EXTRA_OF_MODULE = {
    "casadi": "mpc",
    "foxglove": "foxglove",
    "imageio_ffmpeg": "render",
    "jinja2": "report",
    "matplotlib": "report",
    "mcap": "io",
    "minari": "minari",
    "mujoco": "mujoco",
    "pyarrow": "io",
    "pygame": "render",
    "ray": "cluster",
    "rerun": "rerun",
    "rosbags": "io",
    "ruptures": "diagnosis",
    "sb3_contrib": "rl",
    "sklearn": "diagnosis",
    "stable_baselines3": "rl",
    "tensorboard": "rl",
    "torch": "rl",
    "torchrl": "torchrl",
    "tree": "cluster",
}
"""Import name of an optional library -> extra in pyproject.toml."""

_PACKAGE_OF_MODULE = {"foxglove": "foxglove-sdk", "rerun": "rerun-sdk", "tree": "dm-tree"}
"""Name in the package index where that of the import is another project's."""

_CHECKOUT = Path(__file__).resolve().parents[1]
_TORCH_INDEX = "https://download.pytorch.org/whl/cpu"
"""Where the pinned torch without CUDA is."""


def missing_extra(error: ModuleNotFoundError) -> InputError | None:
    """The sentence for an optional library that is not installed; None when the module is not an optional one."""
    module = (error.name or "").split(".", 1)[0]
    return _sentence(module) if module in EXTRA_OF_MODULE else None


def need(*modules: str) -> None:
    """Ask for optional libraries before long work that uses them at its end.

    Raises:
        InputError: one of them is not installed.
    """
    for module in modules:
        if find_spec(module) is None:
            raise _sentence(module)


def how_to_install(extra: str) -> str:
    """The command that brings an extra to the running interpreter, from the checkout where the package runs from one.

    Args:
        extra: of pyproject.toml.
    """
    python = shlex.quote(sys.executable)
    # the environment that ./ddagr makes need not have a pip of its own
    pip = f"{python} -m pip" if find_spec("pip") else f"python3 -m pip --python {python}"
    if not (_CHECKOUT / "constraints.txt").is_file():
        return f"{pip} install 'ddagr-gym[{extra}]'"
    index = f"--extra-index-url {_TORCH_INDEX} " if extra in ("rl", "torchrl") else ""
    return f"{pip} install -c constraints.txt {index}-e '.[{extra}]' in {_CHECKOUT}"


def _sentence(module: str) -> InputError:
    return InputError(
        f"this needs the package {_PACKAGE_OF_MODULE.get(module, module)!r}, which is not installed: "
        f"run {how_to_install(EXTRA_OF_MODULE[module])}."
    )
