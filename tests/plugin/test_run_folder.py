# SPDX-License-Identifier: BSD-3-Clause
import os

import pytest

from dual_proxy.run_folder import RunFolder


def contents(path):
    return {file.name: file.read_text() for file in path.iterdir()}


def save(folder, **files):
    for stem, text in files.items():
        (folder.draft / stem.replace("_", ".")).write_text(text)
    folder.keep()


def test_new_files_take_the_place_of_all_old_ones(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with RunFolder(tmp_path) as folder:
        save(folder, metrics_json="1", log_mcap="1", replay_html="1")
    with RunFolder(tmp_path) as folder:
        save(folder, metrics_json="2", log_npz="2")
    assert contents(tmp_path) == {
        "notes.txt": "mine",
        "metrics.json": "2",
        "log.npz": "2",
    }


@pytest.mark.parametrize("moves", range(6))
def test_all_files_or_none(tmp_path, monkeypatch, moves):
    old = {"log.npz": "1", "metrics.json": "1", "report.html": "1"}
    with RunFolder(tmp_path) as folder:
        save(folder, log_npz="1", metrics_json="1", report_html="1")
    count = 0

    def replace(source, target, original=os.replace):
        nonlocal count
        count += 1
        if count == moves + 1:
            raise KeyboardInterrupt
        original(source, target)

    monkeypatch.setattr(os, "replace", replace)
    with pytest.raises(KeyboardInterrupt), RunFolder(tmp_path) as folder:
        save(folder, log_npz="2", metrics_json="2", report_html="2")
    assert contents(tmp_path) == old


def test_what_is_not_kept_leaves_nothing(tmp_path):
    with RunFolder(tmp_path / "a" / "b") as folder:
        (folder.draft / "log.npz").write_text("half")
    assert list(tmp_path.iterdir()) == []


def test_one_at_a_time(tmp_path):
    with RunFolder(tmp_path) as folder:
        (folder.draft / "log.npz").write_text("1")
        with pytest.raises(OSError, match="another run") as caught:
            RunFolder(tmp_path)
        assert caught.value.filename == str(tmp_path)
        folder.keep()
    with RunFolder(tmp_path):
        assert contents(tmp_path / ".saving") == {}
    assert contents(tmp_path) == {"log.npz": "1"}


def test_what_a_killed_process_left_is_removed(tmp_path):
    (tmp_path / ".saving").mkdir()
    (tmp_path / ".saving" / "log.npz").write_text("half")
    with RunFolder(tmp_path) as folder:
        save(folder, metrics_json="1")
    assert contents(tmp_path) == {"metrics.json": "1"}


def test_what_cannot_work_is_said_at_once(tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / "folder" / "log.npz").mkdir(parents=True)
    for name, error in (
        ("file", NotADirectoryError),
        ("file/a", NotADirectoryError),
        ("folder", IsADirectoryError),
    ):
        with pytest.raises(error):
            RunFolder(tmp_path / name)
    assert list((tmp_path / "folder").iterdir()) == [tmp_path / "folder" / "log.npz"]


def test_numbered_folders_are_new(tmp_path):
    for end in ("", "-2", "-3"):
        with RunFolder.numbered(tmp_path / "x") as folder:
            assert folder.path == tmp_path / f"x{end}"
            save(folder, metrics_json=end)
