"""Which extra of the package brings a library, for the sentence when it is absent."""

from __future__ import annotations

from ddagr_gym.errors import InputError

EXTRA_OF_MODULE = {
    "casadi": "mpc",
    "imageio_ffmpeg": "render",
    "jinja2": "report",
    "matplotlib": "report",
    "mcap": "io",
    "pyarrow": "io",
    "pygame": "render",
    "ray": "cluster",
    "rosbags": "io",
    "ruptures": "diagnosis",
    "sb3_contrib": "rl",
    "sklearn": "diagnosis",
    "stable_baselines3": "rl",
    "tensorboard": "rl",
    "torch": "rl",
}
"""Import name of an optional library -> extra in pyproject.toml."""


def missing_extra(error: ModuleNotFoundError) -> InputError | None:
    """The sentence for an optional library that is not installed; None when the module is not an optional one."""
    module = (error.name or "").split(".", 1)[0]
    extra = EXTRA_OF_MODULE.get(module)
    if extra is None:
        return None
    return InputError(
        f"this needs the package {module!r}, which is not installed: "
        f"run pip install -c constraints.txt 'ddagr-gym[{extra}]', or start through ./ddagr."
    )
