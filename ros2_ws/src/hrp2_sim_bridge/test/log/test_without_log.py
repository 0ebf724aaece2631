"""A world whose log nobody asked for: it keeps nothing of its past."""

import pytest
from door_impact_common.errors import SettingError


def test_a_log_that_was_not_asked_for_cannot_be_read(make_world, tmp_path) -> None:
    """It would be empty; the error says what to do, and no file is written."""
    world = make_world(log=False, sole="rigid")
    world.step()
    with pytest.raises(SettingError, match="log"):
        world.log()
    with pytest.raises(SettingError, match="log"):
        world.save_log(tmp_path / "run.npz")
    assert not list(tmp_path.iterdir())
