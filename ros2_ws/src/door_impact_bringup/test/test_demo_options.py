"""Options of the demonstration."""

import pytest
from door_impact_bringup import demo


@pytest.mark.parametrize("hits", ["0", "6", "-1", "1.5", "two", ""])
def test_a_number_of_hits_outside_1_to_5_is_refused(tmp_path, capsys, hits):
    """Before anything is started or written."""
    with pytest.raises(SystemExit) as ended:
        demo.main(["--hits", hits, "--out", str(tmp_path / "out")])
    assert ended.value.code == 2
    assert "--hits" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("arguments", "hits"), [([], 1), (["--hits", "1"], 1), (["--hits=5"], 5)])
def test_the_demonstration_hits_as_often_as_it_was_told(tmp_path, monkeypatch, arguments, hits):
    """Once by itself."""
    told = []
    monkeypatch.setattr(demo, "_run", lambda options: told.append(options.hits))
    monkeypatch.setattr(demo.signal, "signal", lambda *_: None)
    assert demo.main([*arguments, "--out", str(tmp_path)]) == 0
    assert told == [hits]
