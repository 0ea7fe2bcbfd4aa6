"""The programs in docs/python.md and docs/use.md run as they are printed."""

import re

from conftest import encode, needs_program, project, sheet

import htvm


@needs_program
def test_the_manual_runs(tmp_path, monkeypatch, capsys):
    (tmp_path / "capture").mkdir()
    for number in range(6):
        htvm.write_mesh(tmp_path / "capture" / f"{number:05}.ply", sheet(number))
    packets = encode(6, unit_micrometres=1000, metadata={"title": "A sheet"})
    (tmp_path / "person.htvm").write_bytes(b"".join(packets))
    monkeypatch.chdir(tmp_path)
    programs = re.findall(r"```python\n(.*?)```", (project / "docs/python.md").read_text(), re.S)
    assert len(programs) >= 5
    names = {}
    for program in programs:
        exec(program, names)
    printed = capsys.readouterr().out
    assert "6 frames at 30.0 per second, A sheet" in printed
    assert htvm.open("copy.htvm").sequence.metadata == {"title": "A walk"}
    assert names["last"].number == 5 and names["measured"].value("m2.rms_mm") < 5
    walk_through = re.findall(r"```python\n(.*?)```", (project / "docs/use.md").read_text(), re.S)
    assert len(walk_through) == 1
    exec(walk_through[0], {})
