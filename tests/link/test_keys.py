# SPDX-License-Identifier: BSD-3-Clause
"""Keys of both sides, and what is said of wrong ones."""

import datetime
import re
import shutil
import stat

import pytest

from dual_proxy.cli import main
from dual_proxy.link import LinkError

pytest.importorskip("cryptography", reason="the extra `hardware` is not installed")

from dual_proxy.link import keys


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys") / "new"
    keys.make_keys(folder, ["192.168.1.10", "robot.local"])
    return folder


@pytest.fixture
def robot(made, tmp_path):
    return shutil.copytree(made / "robot", tmp_path / "robot")


def test_both_sides_get_what_they_need_and_nobody_else_can_read_it(made):
    checked = keys.check_keys(made / "robot", "robot")
    assert checked.hosts == ("192.168.1.10", "robot.local")
    assert keys.check_keys(made / "haptic", "haptic").hosts == keys.LOCAL_HOSTS
    left = checked.valid_until - datetime.datetime.now(datetime.UTC)
    assert datetime.timedelta(364) < left < datetime.timedelta(366)
    files = sorted(p for p in made.rglob("*") if p.is_file())
    assert [str(p.relative_to(made)) for p in files] == [
        f"{side}/{name}.pem"
        for side in ("haptic", "robot")
        for name in ("ca", "certificate", "key")
    ]
    for file in files:
        assert stat.S_IMODE(file.stat().st_mode) == 0o600, file
    for folder in (made, made / "robot", made / "haptic"):
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700, folder
    # The authority's own key is in none of them.
    assert sum("PRIVATE KEY" in p.read_text() for p in files) == 2


def test_command_says_what_to_copy_where_and_never_overwrites(tmp_path, capsys):
    folder = tmp_path / "keys"
    command = ["keys", str(folder), "--haptic-host", "10.0.0.2,desk"]
    assert main(command) == 0
    out = capsys.readouterr().out
    assert f"{folder}/robot: copy it to the robot side's machine" in out
    assert f"{folder}/haptic: copy it to the haptic side's" in out
    assert "(10.0.0.2, desk)" in out
    before = (folder / "robot" / "key.pem").read_bytes()
    assert main(command) == 2
    assert "never overwritten" in capsys.readouterr().err
    assert (folder / "robot" / "key.pem").read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--robot-host", "a b"], "robot host: expected a name or an IPv4 address"),
        (["--haptic-host", ""], "haptic host: expected a name or an IPv4 address"),
        (["--robot-host", "999.1.1.1"], "IPv4 address, got '999.1.1.1'"),
        (["--robot-host", "10.0.0.1."], "IPv4 address, got '10.0.0.1.'"),
        (["--haptic-host", "::1"], "IPv4 address, got '::1'"),
        (["--days", "0"], r"days: expected an integer in \[1, 36500\], got 0"),
    ],
)
def test_command_refuses_what_makes_no_keys(tmp_path, capsys, arguments, said):
    assert main(["keys", str(tmp_path / "keys"), *arguments]) == 2
    assert re.search(said, capsys.readouterr().err)
    assert not (tmp_path / "keys").exists()


def test_command_says_where_it_cannot_write(capsys):
    assert main(["keys", "/dev/null/keys"]) == 2
    assert "/dev/null" in capsys.readouterr().err


def test_what_is_not_there(robot, tmp_path):
    with pytest.raises(LinkError, match=r"is no folder; `dual-proxy keys DIR`"):
        keys.check_keys(tmp_path / "nowhere", "robot")
    for name in ("ca", "certificate", "key"):
        file = robot / f"{name}.pem"
        data = file.read_bytes()
        file.unlink()
        with pytest.raises(LinkError, match=rf"{name}\.pem: No such file"):
            keys.check_keys(robot, "robot")
        file.write_bytes(b"nothing")
        file.chmod(0o600)
        with pytest.raises(LinkError, match=rf"{name}\.pem is no") as refused:
            keys.check_keys(robot, "robot")
        assert "http" not in str(refused.value)
        assert str(refused.value).count("\n") == 0
        file.write_bytes(data)
    keys.check_keys(robot, "robot")


def test_the_folder_of_both_sides(made):
    for side in ("robot", "haptic"):
        said = f"the {side} side needs {made}/{side}$"
        with pytest.raises(LinkError, match=said):
            keys.check_keys(made, side)


def test_a_key_that_others_can_read(robot):
    (robot / "key.pem").chmod(0o640)
    with pytest.raises(LinkError, match=r"mode 0640, expected 0600"):
        keys.check_keys(robot, "robot")


def test_keys_of_the_other_side(made):
    with pytest.raises(LinkError, match="the haptic side needs the folder haptic"):
        keys.check_keys(made / "robot", "haptic")


def test_a_key_of_another_certificate(made, robot):
    shutil.copy(made / "haptic" / "key.pem", robot)
    with pytest.raises(LinkError, match="is not the key of"):
        keys.check_keys(robot, "robot")


def test_a_certificate_of_another_authority(robot, tmp_path):
    keys.make_keys(tmp_path / "other")
    shutil.copy(tmp_path / "other" / "robot" / "ca.pem", robot)
    with pytest.raises(LinkError, match="was not signed by the authority"):
        keys.check_keys(robot, "robot")


def test_keys_whose_time_is_over_or_has_not_come(robot, monkeypatch):
    real = datetime.datetime

    class Clock(real):
        days = 366

        @classmethod
        def now(cls, tz=None):
            return real.now(tz) + datetime.timedelta(cls.days)

    monkeypatch.setattr(keys.datetime, "datetime", Clock)
    with pytest.raises(LinkError, match=r"has expired on .* makes new ones"):
        keys.check_keys(robot, "robot")
    Clock.days = -2
    with pytest.raises(LinkError, match="is not valid before"):
        keys.check_keys(robot, "robot")
    # A clock that is some hours late.
    Clock.days = -0.5
    keys.check_keys(robot, "robot")
