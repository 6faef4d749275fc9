"""Drives of a null bank without recordings: of the stated length, speed, noise and variety."""

import numpy as np

from ddagr_gym.diagnosis.null_bank.standard_drives import DURATION, RATE, standard_template
from ddagr_gym.presets import get_robot


def test_templates_fill_their_time_and_differ() -> None:
    robot = get_robot("ddagr")
    radius = robot.wheels[0].outer_radius
    templates = [standard_template(robot, np.random.default_rng(seed)) for seed in range(12)]
    for template in templates:
        assert len(template.commands) == 3
        for commands in template.commands:
            assert commands.shape == (int(RATE * DURATION), 2)
            assert np.abs(commands).max() * radius < 0.36
            assert (commands[: int(RATE)] == 0.0).all()
        assert len(template.noise) == 8
    received = [bool(t.present[0][:, 5].any()) for t in templates]
    assert any(received)
    first, second = templates[0].commands[0], templates[1].commands[0]
    assert np.abs(first - second).max() > 0.1


def test_the_same_seed_gives_the_same_drives() -> None:
    one, two = (standard_template(get_robot("ddagr"), np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(one.commands[2], two.commands[2])
    assert one.noise == two.noise
    assert one.starts == two.starts
