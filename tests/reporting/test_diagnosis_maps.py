"""Places in the map of a diagnosis."""

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.location import Place
from ddagr_gym.physics.effects.soil_patch import from_middle_line
from ddagr_gym.reporting.diagnosis_maps import _draw_place, _outline

pytest.importorskip("matplotlib", reason="needs the extra report")

BAND = Place(1.0, 0.5, 0.4, half_length=30.0, bearing=2.0)


def test_the_outline_of_a_band_is_its_rim() -> None:
    x, y = _outline(BAND).T
    away = from_middle_line(x - BAND.x, y - BAND.y, BAND.half_length, BAND.bearing)
    np.testing.assert_allclose(away, BAND.radius, rtol=1e-9)


def test_a_disc_is_shown_whole_and_a_band_as_far_as_the_drives_go() -> None:
    from matplotlib.figure import Figure

    for place, wide in ((BAND, 2.0), (Place(0.0, 0.0, 10.0), 20.0)):
        axes = Figure().subplots()
        axes.plot([0.0, 2.0], [0.0, 1.0])
        _draw_place(axes, place)
        axes.autoscale_view()
        assert np.ptp(axes.get_xlim()) == pytest.approx(wide, rel=0.2)
