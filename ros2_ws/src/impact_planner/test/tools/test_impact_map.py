"""The map of requests that can be planned, and the command that writes it."""

import csv

from impact_planner.task.settings import RUN_UPS
from impact_planner.tools import impact_map_cli


def test_the_command_writes_what_it_says(tmp_path, capsys):
    """The command prints a table and writes picture and CSV with sorted, unique angles."""
    assert impact_map_cli.main([
        "--doors", "paper", "--angles", "25", "15", "25", "--restitutions", "0.5",
        "--ending", "retreat", "--out", str(tmp_path / "map")]) == 0
    out = capsys.readouterr().out
    assert "| paper | 0.5 | 15 to 25 |" in out
    assert "4 of 4 requests can be planned" in out
    for name in ("impact_map.csv", "impact_map.png"):
        assert str(tmp_path / "map" / name) in out
    assert (tmp_path / "map" / "impact_map.png").read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((tmp_path / "map" / "impact_map.csv").read_text().splitlines()))
    assert [(row["run_up"], float(row["angle_deg"])) for row in rows] == [
        (run_up, angle) for run_up in RUN_UPS for angle in (15.0, 25.0)]
