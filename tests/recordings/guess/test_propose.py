"""Proposed topic maps: what is chosen, why, and what the data overrule."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.guess.propose import map_entries, propose
from ddagr_gym.recordings.load import load_recording
from tests.recordings.bags import (
    IMU,
    JOINTS,
    LEVEL,
    ODOMETRY,
    STAMPED,
    TWIST,
    Drive,
    Sent,
    split,
    stamp,
    transform,
    write,
)

UPSIDE_DOWN = np.diag([1.0, -1.0, -1.0])
TO_THE_LEFT = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
FOUR = (("fl", "left", 1), ("fr", "right", 1), ("rl", "left", 1), ("rr", "right", 1))


@pytest.fixture(scope="module")
def recording(make_drive):
    return make_drive(seconds=60.0)


@pytest.fixture(scope="module")
def drive(recording, warthog):
    return Drive(recording.columns(), warthog.wheel_radius, warthog.half_track)


@pytest.fixture(scope="module")
def usual(drive):
    return drive.messages()


def without(messages, kind):
    return [message for message in messages if message.kind != kind]


@pytest.fixture
def proposed(tmp_path, warthog):
    """Function that proposes a map for messages, with the robot's geometry."""

    def make(messages, geometry=warthog, **options):
        return propose(write(tmp_path / "bag", messages), geometry, "warthog" if geometry else "", **options)

    return make


def topics_of(proposal):
    return {role: source.topic for role, source in proposal.topic_map.topics.items()}


def why(proposal, topic):
    return next(row.why for row in proposal.topics if row.name == topic)


USUAL = {"imu": "/imu/data", "wheels": "/joint_states", "command": "/cmd_vel", "pose": "/odometry/gps"}


def test_a_usual_bag(tmp_path, usual, warthog, recording):
    extra = [Sent("/battery", "my_msgs/msg/Battery", t, {"level": 1.0}) for t in range(5)]
    path = split(tmp_path / "bag", [*usual, *extra], 2, "mcap")
    proposal = propose(path, warthog, "warthog")
    assert topics_of(proposal) == USUAL
    assert proposal.topic_map.robot == "warthog"
    assert (proposal.corrections, proposal.ambiguous, proposal.missing) == ((), (), ())
    rows = {row.name: row for row in proposal.topics}
    assert list(rows) == sorted(rows)
    assert (rows["/imu/data"].count, rows["/imu/data"].frame) == (3000, "imu_link")
    assert rows["/imu/data"].rate == pytest.approx(50.0, rel=1e-3)
    assert (rows["/battery"].role, rows["/battery"].why) == ("", "not read")
    assert "gravity is in z" in proposal.reasons["imu"]
    assert "by name" in proposal.reasons["wheels"]
    assert "the wheels follow it 0." in proposal.reasons["command"]
    assert "in the frame map" in proposal.reasons["pose"]
    assert len(proposal.findings) > 8
    assert not [finding for finding in proposal.findings if finding.status is Status.SUSPICIOUS]
    # The map that is written gives the recording that was written.
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(map_entries(proposal.topic_map)))
    found = load_recording(path, str(tmp_path / "map.yaml"), geometry_of=lambda _: warthog)
    assert found.meta.robot == "warthog"
    np.testing.assert_allclose(found["yaw_rate"], recording["yaw_rate"], atol=1e-9)
    known = np.isfinite(found["encoder_right"])
    assert known.sum() == 1500
    np.testing.assert_allclose(found["encoder_right"][known], recording["encoder_right"][known], atol=1e-9)
    assert found.has("command_right", "pose_yaw")


@pytest.mark.parametrize("geometry", [True, False])
def test_wheels_without_sides_in_their_names(drive, usual, warthog, geometry, proposed):
    joints = [("w1", "right", 1), ("w2", "left", 1), ("w3", "right", 1), ("w4", "left", 1), ("arm_1", "", 1)]
    proposal = proposed([*without(usual, JOINTS), *drive.wheels(joints=joints)], warthog if geometry else None)
    wheels = proposal.topic_map.topics["wheels"]
    assert (set(wheels.right), set(wheels.left)) == ({"w1", "w3"}, {"w2", "w4"})
    assert "as the gyro says" in proposal.reasons["wheels"]


def test_two_wheels_the_first_of_which_is_the_left_one(drive, usual, proposed):
    joints = [("motor_a", "left", 1), ("motor_b", "right", 1)]
    wheels = proposed([*without(usual, JOINTS), *drive.wheels(joints=joints)]).topic_map.topics["wheels"]
    assert (wheels.right, wheels.left) == (("motor_b",), ("motor_a",))


@pytest.mark.parametrize("first", ["left", "right"])
@pytest.mark.parametrize(("lacks", "told"), [((IMU,), True), ((IMU, ODOMETRY), False)])
def test_sides_without_an_imu_are_either_told_by_motion_or_open(drive, usual, first, lacks, told, proposed):
    second = "left" if first == "right" else "right"
    messages = [message for message in without(usual, JOINTS) if message.kind not in lacks]
    proposal = proposed([*messages, *drive.wheels(joints=[("a", first, 1), ("b", second, 1)])])
    said = [sentence for sentence in proposal.ambiguous if "which side is right" in sentence]
    assert len(said) == (not told)
    assert ("by motion" in proposal.reasons["wheels"]) == told
    if told:
        wheels = proposal.topic_map.topics["wheels"]
        assert (wheels.right, wheels.left) == ((("a",), ("b",)) if first == "right" else (("b",), ("a",)))
    assert len(proposal.corrections) == (told and first == "left")


def test_two_equal_wheels_stay_ambiguous_where_their_sides_are_open_too(drive, usual, proposed):
    joints = [("a", "left", 1), ("b", "right", 1)]
    twins = [*drive.wheels(joints=joints), *drive.wheels("/joint_states_too", joints=joints)]
    proposal = proposed([*(m for m in usual if m.kind not in (JOINTS, IMU)), *twins], None)
    assert any("are alike but for" in sentence for sentence in proposal.ambiguous)
    assert any("which side is right" in sentence for sentence in proposal.ambiguous)


def test_names_of_the_wrong_side_are_overruled_by_motion(drive, usual, proposed):
    joints = [(name, {"left": "right", "right": "left"}[bank], 1) for name, bank, _ in FOUR]
    proposal = proposed([*without(usual, JOINTS), *drive.wheels(joints=joints)])
    wheels = proposal.topic_map.topics["wheels"]
    assert (wheels.right, wheels.left) == (("fl", "rl"), ("fr", "rr"))
    assert "the right wheels moves as the left ones" in " ".join(proposal.corrections)
    assert "by motion" in proposal.reasons["wheels"]
    assert "follow it 0." in proposal.reasons["command"]  # judged by the wheels as they are after that
    assert not proposal.ambiguous


def test_wheels_that_count_backwards_get_a_sign(drive, usual, proposed):
    joints = [(name, bank, -1 if bank == "left" else 1) for name, bank, _ in FOUR]
    proposal = proposed([*without(usual, JOINTS), *drive.wheels(joints=joints)])
    assert proposal.topic_map.signs == {"encoder_left": -1}
    assert "counts backwards" in " ".join(proposal.corrections)
    assert not proposal.ambiguous


def test_a_gyro_that_turns_the_wrong_way_gets_a_sign(drive, usual, proposed):
    negated = replace(drive, columns={**drive.columns, "yaw_rate": -drive.columns["yaw_rate"]})
    proposal = proposed([*without(usual, IMU), *negated.imu()])
    assert proposal.topic_map.signs == {"yaw_rate": -1}
    assert "yaw_rate with the wrong sign" in " ".join(proposal.corrections)


def test_an_imu_upside_down_gets_signs_or_its_frame(drive, usual, proposed, tmp_path, warthog):
    upside_down = [*without(usual, IMU), *drive.imu(rotation=UPSIDE_DOWN)]
    proposal = proposed(upside_down)
    assert proposal.topic_map.signs == {"specific_force_y": -1, "specific_force_z": -1, "yaw_rate": -1}
    mounted = transform(0.0, "base_link", "imu_link", roll=np.pi, topic="/tf_static")
    proposal = propose(write(tmp_path / "mounted", [*upside_down, mounted]), warthog)
    assert proposal.topic_map.topics["imu"].frame == "base_link"
    assert (proposal.topic_map.signs, proposal.ambiguous) == ({}, ())
    assert "turned from imu_link into base_link" in proposal.reasons["imu"]
    assert why(proposal, "/tf_static") == "transforms between frames"


@pytest.mark.parametrize(("rotation", "frame"), [(TO_THE_LEFT, "base_link"), (LEVEL, "")])
def test_transforms_are_used_only_where_motion_agrees(drive, usual, proposed, rotation, frame):
    # A driver may publish in the robot's axes already, though the description of the robot turns the sensor.
    mounted = transform(0.0, "base_link", "imu_link", yaw=np.pi / 2, topic="/tf_static")
    proposal = proposed([*without(usual, IMU), *drive.imu(rotation=rotation), mounted])
    assert proposal.topic_map.topics["imu"].frame == frame
    assert ("axes already" in " ".join(proposal.corrections)) == (frame == "")


def test_the_imu_with_gravity_is_taken(drive, usual, proposed):
    in_g = drive.imu("/another/imu", every=1, scale=1 / 9.80665)
    camera = drive.imu("/camera/imu", every=2)
    slow = drive.imu("/slow/imu", every=10)
    proposal = proposed([*usual, *in_g, *camera, *slow])
    assert topics_of(proposal)["imu"] == "/imu/data"
    assert "in g" in why(proposal, "/another/imu")
    assert "another sensor" in why(proposal, "/camera/imu")
    assert "only 5 Hz" in why(proposal, "/slow/imu")
    assert not proposal.ambiguous


def test_two_equal_imus_are_ambiguous(drive, usual, proposed):
    proposal = proposed([*usual, *drive.imu("/imu/second", every=2)])
    assert topics_of(proposal)["imu"] == "/imu/data"
    assert "/imu/data and /imu/second are alike but for" in " ".join(proposal.ambiguous)


def test_the_command_is_what_the_wheels_follow(drive, usual, proposed):
    ignored = replace(drive, columns={**drive.columns, "command_right": np.roll(drive.columns["command_right"], 700)})
    messages = [
        *usual,
        *ignored.twist("/autonomy/cmd_vel"),
        *drive.twist("/joy/cmd_vel", STAMPED),
        *drive.twist("/velocity", STAMPED, source="encoder", late=0.2),
        *drive.twist("/odom_twist", STAMPED, source="encoder"),
    ]
    proposal = proposed(messages)
    assert topics_of(proposal)["command"] == "/cmd_vel"
    assert "correlation" in why(proposal, "/autonomy/cmd_vel")
    assert "before a multiplexer" in why(proposal, "/joy/cmd_vel")
    assert "after the wheels" in why(proposal, "/velocity")
    assert "measurement" in why(proposal, "/odom_twist")


def test_a_measured_twist_alone_is_no_command(drive, usual, proposed):
    proposal = proposed([*without(usual, TWIST), *drive.twist("/velocity", STAMPED, source="encoder", late=0.2)])
    assert "command" not in proposal.topic_map.topics
    (missing,) = proposal.missing
    assert "after the wheels: measured, not commanded" in missing
    assert "`ddagr diagnose`" in missing


def test_a_pose_from_the_wheels_is_left_out(drive, usual, proposed):
    proposal = proposed([*without(usual, ODOMETRY), *drive.wheel_odometry()])
    assert "pose" not in proposal.topic_map.topics
    assert "computed from the wheels" in " ".join(proposal.missing)


def test_a_localisation_in_the_transforms_is_the_pose(drive, usual, proposed, tmp_path, warthog):
    reckoned = drive.dead_reckoned()
    poses = {round(t, 6): values for t, values in drive.rows("pose_x", "pose_y", "pose_yaw")}
    messages = without(usual, ODOMETRY)
    for t, x, y, yaw in reckoned:
        messages.append(transform(float(t), "odom", "base_link", x, y, yaw))
        if round(float(t), 6) in poses:
            px, py, pyaw = poses[round(float(t), 6)]
            turn = pyaw - yaw
            cos, sin = np.cos(turn), np.sin(turn)
            shift = {"x": px - cos * x + sin * y, "y": py - sin * x - cos * y, "yaw": turn}
            messages.append(transform(float(t) - 0.001, "map", "odom", **shift))
    path = write(tmp_path / "tf", messages)
    proposal = propose(path, warthog, "warthog")
    pose = proposal.topic_map.topics["pose"]
    assert (pose.topic, pose.parent, pose.child) == ("/tf", "map", "base_link")
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(map_entries(proposal.topic_map)))
    found = load_recording(path, str(tmp_path / "map.yaml"), geometry_of=lambda _: warthog)
    known = np.flatnonzero(np.isfinite(found["pose_x"]))
    assert len(known) > 200
    np.testing.assert_allclose(found["pose_x"][known], drive.columns["pose_x"][known], atol=1e-6)


def test_stamps_of_two_clocks_are_not_mixed(usual, proposed):
    odd = [replace(m, values={**m.values, "header": {"stamp": {"sec": 5}}}) if m.kind == IMU else m for m in usual]
    proposal = proposed(odd)
    assert proposal.topic_map.stamps == "receive"
    assert "no time in common" in " ".join(proposal.ambiguous)


def in_simulated_time(messages):
    """Headers that begin at 12 s; the receipts stay."""
    for m in messages:
        nanoseconds = round((m.t + 12.0) * 1e9)
        header = {"stamp": {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}, "frame_id": m.frame}
        yield m if m.kind == TWIST else replace(m, values={**m.values, "header": header})


def test_simulated_time_beside_commands_without_a_header(usual, proposed):
    proposal = proposed([*in_simulated_time(usual)])
    assert proposal.topic_map.stamps == "receive"
    assert topics_of(proposal) == USUAL
    assert "the wheels follow it 0." in proposal.reasons["command"]
    (said,) = proposal.ambiguous
    assert "the times of receipt of /cmd_vel, which has no others," in said


def test_a_clock_that_is_set_back_leaves_times_of_receipt(usual, proposed):
    def stamped(m):
        back = 5.0 if m.t >= 30.0 and m.kind == IMU else 0.0
        return replace(m, values={**m.values, "header": {"stamp": stamp(m.t - back), "frame_id": m.frame}})

    proposal = proposed([m if m.kind == TWIST else stamped(m) for m in usual])
    assert proposal.topic_map.stamps == "receive"
    assert "the header stamps of /imu/data go back by 4.98 s" in " ".join(proposal.ambiguous)


@pytest.mark.parametrize("names", [["arm_1", "arm_2"], []])
def test_arms_on_the_topic_of_the_wheels(usual, proposed, names):
    """The very first message is one of the arm's."""
    arms = [
        Sent("/joint_states", JOINTS, k / 30, {"name": names, "velocity": [0.1] * len(names)}) for k in range(-1, 1800)
    ]
    proposal = proposed([*usual, *arms])
    assert "left_wheel left by name" in proposal.reasons["wheels"]
    assert not [finding for finding in proposal.findings if finding.status is Status.SUSPICIOUS]


def test_joints_in_changing_order_are_all_taken(usual, proposed):
    def turned(m):
        return replace(m, values={name: values[::-1] for name, values in m.values.items()})

    wheels = [m for m in usual if m.kind == JOINTS]
    proposal = proposed([*without(usual, JOINTS), *(turned(m) if k % 2 else m for k, m in enumerate(wheels))])
    (row,) = [row for row in proposal.topics if row.name == "/joint_states"]
    assert row.rate == pytest.approx(25.0, rel=1e-3)


def test_wheels_that_never_come_in_one_message_are_none(usual, proposed):
    def parts(m):
        for k, name in enumerate(m.values["name"]):
            yield replace(m, t=m.t + 1e-3 * k, values={"name": [name], "velocity": m.values["velocity"][k : k + 1]})

    proposal = proposed([*without(usual, JOINTS), *(part for m in usual if m.kind == JOINTS for part in parts(m))])
    assert proposal.missing[0].startswith("no wheels (no JointState")


@pytest.mark.parametrize(
    ("kind", "words"), [(JOINTS, "no wheels"), (TWIST, "no command"), (ODOMETRY, "no pose"), (IMU, "no imu")]
)
def test_what_is_missing_is_said_with_its_cost(usual, proposed, kind, words):
    proposal = proposed(without(usual, kind))
    (missing,) = proposal.missing
    assert missing.startswith(words)
    assert proposal.topic_map.base == ("wheels" if kind == IMU else "imu")


def test_without_a_robot_that_is_said(usual, proposed):
    proposal = proposed(usual, None)
    assert proposal.missing[0].startswith("no robot (--robot)")
    assert topics_of(proposal) == USUAL


def twice(messages):
    return [replace(m, topic=f"/{name}{m.topic}") for name in ("alpha", "beta") for m in messages]


def test_two_robots_need_a_namespace(usual, proposed, tmp_path, warthog):
    with pytest.raises(InputError, match=r"topics of 2 robots, /alpha, /beta: .* --namespace /alpha"):
        proposed(twice(usual))
    proposal = propose(write(tmp_path / "two", twice(usual)), warthog, namespace="/beta")
    assert topics_of(proposal) == {role: f"/beta{topic}" for role, topic in USUAL.items()}
    with pytest.raises(InputError, match="below 'gamma': its namespaces are /alpha, /beta"):
        propose(tmp_path / "two", warthog, namespace="gamma")


def test_imus_in_two_places_are_one_robot(drive, usual, proposed):
    both = [*without(usual, IMU), *drive.imu("/front/imu/data"), *drive.imu("/rear/imu/data", every=2)]
    assert topics_of(proposed(both))["imu"] == "/front/imu/data"


BATTERY = [Sent("/battery", "my_msgs/msg/Battery", 0.1 * t) for t in range(9)]


@pytest.mark.parametrize(
    ("messages", "words"),
    [
        ([], r"bag holds no messages \(0 topics\)"),
        (BATTERY, "no message that is read here, only Battery"),
        ([Sent("/cmd_vel", TWIST, 0.1 * t) for t in range(9)], "neither an IMU nor wheels"),
    ],
)
def test_bags_without_a_drive_get_one_sentence(proposed, messages, words):
    with pytest.raises(InputError, match=words) as caught:
        proposed(messages)
    assert "\n" not in str(caught.value)


def test_joints_without_velocities_are_no_wheels(usual, proposed):
    still = [
        replace(m, values={"name": m.values["name"], "position": m.values["velocity"]}) if m.kind == JOINTS else m
        for m in usual
    ]
    proposal = proposed(still)
    assert "no JointState has two or more joints with velocities" in " ".join(proposal.missing)
