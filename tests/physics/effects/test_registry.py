"""Finding effects by name, in texts, and in other packages."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from importlib.metadata import EntryPoint

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import effect_kind, effect_kinds, parse_effect, registry
from ddagr_gym.physics.effects.base import Effect, build_effect, effect_table, size
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.simulator import simulate


def test_texts_name_the_size_first_and_others_by_name():
    assert parse_effect("slope=0.06,direction=0.5") == Slope(0.06, 0.5)
    assert parse_effect(" slope = 0.06 , direction = 0.5 ") == Slope(0.06, 0.5)
    assert parse_effect("gyro_sign").flip == 1.0
    assert parse_effect("imu_tilt=0,pitch=-1e-1").pitch == -0.1


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("slop=1", r"unknown effect 'slop': did you mean 'slope'"),
        ("", r"unknown effect ''"),
        ("slope", r"effect 'slope' needs 'angle' \[rad\]: write slope=VALUE"),
        ("slope=0.1,direktion=1", r"effect 'slope' has no parameter 'direktion': it takes angle, direction"),
        ("slope=0.1,0.2", r"write '0.2' as parameter=value"),
        ("slope=0.1,angle=0.2", r"gives 'angle' twice"),
        ("slope=steep", r"effect 'slope' got .*'steep'.*: parameters are numbers"),
        ("slope=nan", r"Slope.angle is nan: give a finite value in \[-0.6, 0.6\] rad"),
        ("slope=3", r"Slope.angle is 3: give a finite value in \[-0.6, 0.6\] rad"),
    ],
)
def test_bad_texts_are_refused_in_one_sentence(text, sentence):
    with pytest.raises(InputError, match=sentence):
        parse_effect(text)


@pytest.mark.parametrize("name", [None, 3, [], "Slope"])
def test_only_exact_names_are_known(name):
    with pytest.raises(InputError, match="unknown effect"):
        effect_kind(name)


def test_values_that_are_no_numbers_are_refused():
    with pytest.raises(InputError, match="parameters are numbers"):
        build_effect(Slope, {"angle": [1.0]})


def test_vector_is_padded_in_the_order_of_the_fields():
    np.testing.assert_array_equal(Slope(0.1, 0.2).vector(), [0.1, 0.2, 0, 0, 0, 0, 0, 0])
    assert Slope(0.1, 0.2).as_mapping() == {"name": "slope", "parameters": {"angle": 0.1, "direction": 0.2}}


def test_table_of_no_effects_is_empty():
    points, addresses, parameters = effect_table(())
    assert points.shape == addresses.shape == (0,)
    assert parameters.shape == (0, layout.EFFECT_PARAMETERS)


MODULE = '''
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, size
from ddagr_gym.physics.layout import POINT_READINGS, READING


def shift(row, parameters, memory):
    row[READING + 2] += FACTOR * parameters[0]


@dataclass(frozen=True)
class Foreign(Effect):
    """An effect of another package."""

    name = "foreign"
    title = "Foreign"
    group = "sensors"
    equation = "yaw_rate + bias"
    source = "ours"
    signature = "none"
    actions = ((POINT_READINGS, shift),)

    bias: float = size("rad/s", -1.0, 1.0, least=0.1)
'''


@pytest.fixture
def entry_points(monkeypatch):
    """Installs entry points for one test."""

    def install(*points):
        monkeypatch.setattr(registry, "entry_points", lambda group: points)
        effect_kinds.cache_clear()

    yield install
    effect_kinds.cache_clear()


@pytest.fixture
def foreign_module(tmp_path, monkeypatch):
    """Writes a module with an effect and returns its entry point."""
    monkeypatch.syspath_prepend(tmp_path)

    def write(module, factor):
        (tmp_path / f"{module}.py").write_text(textwrap.dedent(MODULE).replace("FACTOR", factor))
        return EntryPoint("foreign", f"{module}:Foreign", registry.ENTRY_POINT_GROUP)

    return write


def test_other_packages_add_effects(entry_points, foreign_module, robot, soil, ideal_sensors):
    entry_points(foreign_module("foreign_effects", "1.0"))
    columns = simulate(robot, soil, np.zeros((3, 2)), sensors=ideal_sensors, effects=["foreign=0.25"])
    np.testing.assert_allclose(columns["yaw_rate"], 0.25, atol=1e-9)


def test_edited_effect_of_another_package_is_compiled_anew(entry_points, foreign_module, robot, soil, ideal_sensors):
    """Both modules have one name and lie in one place, as before and after an edit between two processes."""
    import sys

    from ddagr_gym import jit

    # of different length: Python's own cache tells files apart by second and size
    for factor in ("2.0", "3.00"):
        jit._folder_stamp.cache_clear()
        sys.modules.pop("edited_effects", None)
        entry_points(foreign_module("edited_effects", factor))
        columns = simulate(robot, soil, np.zeros((3, 2)), sensors=ideal_sensors, effects=["foreign=0.1"])
        np.testing.assert_allclose(columns["yaw_rate"], float(factor) * 0.1, atol=1e-9)


def test_entry_point_that_is_no_effect_is_refused(entry_points):
    entry_points(EntryPoint("wrong", "math:pi", registry.ENTRY_POINT_GROUP))
    with pytest.raises(InputError, match=r"entry point 'wrong' of ddagr_gym.effects is 3.14.*give an Effect subclass"):
        effect_kinds()


def test_entry_point_may_not_replace_an_effect(entry_points):
    point = EntryPoint("other", "ddagr_gym.physics.effects.slope:Slope", registry.ENTRY_POINT_GROUP)
    entry_points(point)
    with pytest.raises(InputError, match="brings the effect 'slope', which exists"):
        effect_kinds()


@pytest.mark.parametrize("amount", [1.0, 2.0])
def test_action_made_in_a_function_keeps_what_it_captured(amount, robot, soil, ideal_sensors):
    """Two such actions look alike to a cache on disk; they must not be mixed up."""

    def act(row, parameters, memory):
        row[layout.READING + 2] = amount

    @dataclass(frozen=True)
    class Captured(Effect):
        name = "captured"
        actions = ((layout.POINT_READINGS, act),)
        bias: float = size("-", 0.0, 1.0, least=1.0)

    columns = simulate(robot, soil, np.zeros((2, 2)), sensors=ideal_sensors, effects=[Captured(0.0)])
    np.testing.assert_array_equal(columns["yaw_rate"], amount)
