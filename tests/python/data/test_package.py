"""Fetching and unpacking the furniture package, with stand-ins for apt-get and dpkg-deb."""

import stat

import pytest

from vnreg_train.data import package
from vnreg_train.data.catalog import ARCHIVES
from vnreg_train.data.package import PackageError, fetch_archives

DOWNLOAD = 'touch "sweethome3d-furniture_1.8-1_all.deb"'
UNPACK = f"""for name in {" ".join(ARCHIVES)}; do
  mkdir -p "$3/usr/share/sweethome3d/furniture"
  echo x > "$3/usr/share/sweethome3d/furniture/$name.sh3f"
done"""


@pytest.fixture
def stand_ins(tmp_path, monkeypatch):
    """Put shell scripts of these names first on the path; they log their arguments."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder), prepend=":")
    log = tmp_path / "log"

    def install(**scripts: str) -> None:
        for name, body in scripts.items():
            script = folder / name.replace("_", "-")
            script.write_text(f'#!/bin/sh\necho "{script.name} $1" >> "{log}"\n{body}\n')
            script.chmod(script.stat().st_mode | stat.S_IXUSR)

    install.log = lambda: log.read_text().split("\n")[:-1]
    return install


def test_download_and_unpack_once(tmp_path, stand_ins, monkeypatch):
    monkeypatch.setattr(package, "_has_apt_lists", lambda: True)
    stand_ins(apt_get=DOWNLOAD, dpkg_deb=UNPACK)
    for _ in range(2):
        folder, version = fetch_archives(tmp_path / "cache")
        assert version == "1.8-1"
        assert sorted(path.stem for path in folder.iterdir()) == sorted(ARCHIVES)
    assert stand_ins.log() == ["apt-get download", "dpkg-deb -x"]


def test_lists_are_fetched_only_where_there_are_none(tmp_path, stand_ins, monkeypatch):
    monkeypatch.setattr(package, "_has_apt_lists", lambda: False)
    stand_ins(apt_get=f"test $1 = update || {DOWNLOAD}", dpkg_deb=UNPACK)
    fetch_archives(tmp_path / "cache")
    assert stand_ins.log() == ["apt-get update", "apt-get download", "dpkg-deb -x"]


def test_a_package_put_there_by_hand_is_used(tmp_path, stand_ins):
    cache = tmp_path / "cache"
    cache.mkdir()
    (cache / "sweethome3d-furniture_1.8-1_all.deb").touch()
    (cache / "sweethome3d-furniture_1.9-1_all.deb").touch()
    stand_ins(apt_get="exit 1", dpkg_deb=UNPACK)
    assert fetch_archives(cache)[1] == "1.8-1"
    assert stand_ins.log() == ["dpkg-deb -x"]


def test_failures_say_what_to_do(tmp_path, stand_ins, monkeypatch):
    monkeypatch.setattr(package, "_has_apt_lists", lambda: True)
    stand_ins(apt_get="echo 'E: no network' >&2; exit 100", dpkg_deb="exit 2")
    with pytest.raises(PackageError, match=r"E: no network \(by hand: put sweethome3d-furniture"):
        fetch_archives(tmp_path / "cache")
    stand_ins(apt_get="true")
    with pytest.raises(PackageError, match="downloaded no sweethome3d-furniture"):
        fetch_archives(tmp_path / "cache")
    stand_ins(apt_get=DOWNLOAD)
    with pytest.raises(PackageError, match=r"dpkg-deb -x .* failed"):
        fetch_archives(tmp_path / "cache")
    stand_ins(dpkg_deb='mkdir -p "$3"')
    with pytest.raises(PackageError, match="are not in the package"):
        fetch_archives(tmp_path / "cache")


def test_a_system_without_apt(tmp_path, monkeypatch):
    monkeypatch.setattr(package, "_has_apt_lists", lambda: True)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(PackageError, match="apt-get is not on this system"):
        fetch_archives(tmp_path / "cache")
