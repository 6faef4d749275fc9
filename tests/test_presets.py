"""Named robots and soils: what the thesis and the shared table say, fresh copies, names that are not there."""

import csv
import math
from dataclasses import replace

import pytest

from ddagr_gym.config import configs_dir, dump_config
from ddagr_gym.errors import InputError
from ddagr_gym.presets import get_robot, get_soil, robot_names, robot_option, soil_names, soil_source


def test_ddagr_is_tables_6_1_and_a_1():
    robot = get_robot("ddagr")
    assert (robot.mass, robot.yaw_inertia, robot.half_track, robot.half_wheelbase) == (168.0, 100.0, 0.58, 0.33)
    wheel = robot.wheels[0]
    assert (wheel.minor_radius, wheel.half_width, wheel.major_radius) == (0.05, 0.1016, 0.2294)
    assert wheel.outer_radius == pytest.approx(0.28, abs=0.001)
    assert robot.motor_rate == 4.5


def test_thesis_soil_is_table_a_1():
    soil = get_soil("thesis_a1")
    assert (soil.cohesion, math.degrees(soil.friction_angle)) == pytest.approx((4140.0, 13.0))
    assert (soil.sinkage_exponent, soil.cohesive_modulus, soil.frictional_modulus) == (0.5, 13190.0, 692000.0)
    assert (soil.shear_modulus, soil.exit_angle_ratio) == (0.006, 0.9)
    assert (soil.peak_stress_coefficient_0, soil.peak_stress_coefficient_1) == (0.5, 0.5)


def test_every_published_soil_is_the_shared_tables(shared_dir):
    with (shared_dir / "reference" / "soils.csv").open(newline="") as handle:
        table = list(csv.DictReader(handle))
    published = [get_soil(name) for name in soil_names() if name not in ("thesis_a1", "firm_ground")]
    assert len(published) == len(table) == 28
    for soil, row in zip(published, table, strict=True):
        assert soil.sinkage_exponent == float(row["n"])
        assert soil.cohesive_modulus == pytest.approx(1e3 * float(row["kc_kN_per_m_np1"]))
        assert soil.frictional_modulus == pytest.approx(1e3 * float(row["kphi_kN_per_m_np2"]))
        assert soil.cohesion == pytest.approx(1e3 * float(row["c_kPa"]))
        assert math.degrees(soil.friction_angle) == pytest.approx(float(row["phi_deg"]))
        assert soil.shear_modulus == float(row["K_m"])
        for width, depth in ((0.1, 0.01), (0.1, 0.03)):
            stated = 1e3 * float(row[f"p_{round(100 * depth)}cm_b0.1_kPa"])
            assert soil.pressure(depth, width) == pytest.approx(stated, rel=1e-9)


@pytest.mark.parametrize("name", soil_names())
def test_every_soil_has_a_source_and_comes_fresh(name):
    assert len(soil_source(name)) > 5
    assert get_soil(name) == get_soil(name)
    assert get_soil(name) is not get_soil(name)


@pytest.mark.parametrize("name", robot_names())
def test_every_robot_is_named_sourced_and_physical(name):
    robot = get_robot(name)
    assert robot.name == name
    assert robot.source
    # a yaw inertia between that of a point and that of the mass at the corners of a box half as large again
    assert 0.0 < robot.yaw_inertia < 1.5**2 * robot.mass * (robot.half_track**2 + robot.half_wheelbase**2)
    assert robot.wheels[0].minor_radius <= robot.wheels[0].major_radius
    assert len(robot.wheels) == 4


@pytest.mark.parametrize(
    ("get", "name", "suggestion"),
    [
        (get_soil, "thesis_a", "'thesis_a1'"),
        (get_soil, "firm-ground", "'firm_ground'"),
        (get_robot, "dagr", "'ddagr'"),
        (get_robot, "warthogs", "'warthog'"),
        (soil_source, "thesis_a2", "'thesis_a1'"),
    ],
)
def test_unknown_name_suggests_the_closest(get, name, suggestion):
    with pytest.raises(InputError) as error:
        get(name)
    assert repr(name) in str(error.value)
    assert suggestion in str(error.value)


@pytest.mark.parametrize("name", ["", "zzz", 3, None])
def test_name_like_no_other_lists_all(name):
    with pytest.raises(InputError) as error:
        get_robot(name)
    assert all(known in str(error.value) for known in robot_names())


def test_a_robot_of_ones_own_is_a_file():
    mine = get_robot(str(configs_dir() / "robots" / "example.yaml"))
    assert replace(mine, name="ddagr", source=get_robot("ddagr").source) == get_robot("ddagr")


@pytest.mark.parametrize("name", ["thesis_a1", "firm_ground"])
def test_soils_come_back_from_files(name, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(dump_config(get_soil(name)))
    assert get_soil(str(path)) == get_soil(name)
    assert soil_source(str(path)) == str(path)


def test_files_that_do_not_fit_are_refused_with_the_place(tmp_path):
    path = tmp_path / "mine.yaml"
    with pytest.raises(InputError, match="cannot be read"):
        get_robot(str(path))
    path.write_text(dump_config(get_soil("thesis_a1")).replace("cohesion: 4140.0", "cohesion: -1"))
    with pytest.raises(InputError, match="cohesion"):
        get_soil(str(path))
    with pytest.raises(InputError, match="unknown key 'cohesion'"):
        get_robot(str(path))


def test_a_robot_that_is_no_preset_is_named_by_its_file():
    assert robot_option("husky") == "--robot husky"
    assert robot_option("rover") == "--robot FILE.yaml (the file that describes it)"
