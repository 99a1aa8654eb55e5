# pyright: standard
"""Machine code on disk: used again, never believed when damaged or another's, and never a reason to fail."""

import errno
import os
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from pneumo.simulation import compiled
from pneumo.simulation.compiled import cache_folder, kernel


def doubled(x: float) -> float:
    return 2 * x


doubled.__module__ = "pneumo.errors"  # any module of pneumo, whose sources name the folder


@pytest.fixture
def used(tmp_path, monkeypatch, capsys):
    """Compile a small kernel as a new process would; give how often it came from disk, and what was said."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))

    def use() -> tuple[int, list[str]]:
        compiled._warned.clear()
        anew = kernel(doubled)
        assert anew(1.5) == 3.0 and anew(2) == 4  # two signatures
        return sum(anew.stats.cache_hits.values()), capsys.readouterr().err.splitlines()

    return use


def files() -> list[Path]:
    return sorted(cache_folder("pneumo.errors").iterdir())


def test_compiled_code_is_used_again_but_not_from_a_folder_that_others_can_write_to(used, monkeypatch):
    assert used() == (0, [])
    assert used() == (2, [])
    assert [file.stat().st_mode & 0o777 for file in files()] == [0o600, 0o600]
    assert files()[0].parent.stat().st_mode & 0o777 == 0o700
    used()
    folder = cache_folder("pneumo.errors")
    for mode in (0o770, 0o702):
        folder.chmod(mode)
        hits, (line,) = used()
        assert hits == 0 and "others can write there" in line
    folder.chmod(0o755)
    assert used() == (2, [])
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)  # as if it were another user's
    hits, (line,) = used()
    assert hits == 0 and "others can write there" in line


def signed(file: Path, content: bytes) -> bytes:
    return compiled.sha256(file.name.encode() + content).digest() + content


def flipped(content: bytes) -> bytes:
    return content[:-1000] + bytes([content[-1000] ^ 1]) + content[-999:]


SPOIL = {
    "truncated": lambda file: os.truncate(file, file.stat().st_size // 2),
    "emptied": lambda file: file.write_bytes(b""),
    "flipped": lambda file: file.write_bytes(flipped(file.read_bytes())),
    "of another kernel": lambda file: file.write_bytes(files()[1].read_bytes()),
    "shared": lambda file: file.chmod(0o666),
    "of a lower checksum": lambda file: file.write_bytes(bytes(32) + file.read_bytes()[32:]),
    "of a higher checksum": lambda file: file.write_bytes(b"\xff" * 32 + file.read_bytes()[32:]),
    "not loadable": lambda file: file.write_bytes(signed(file, b"pickled by other versions")),
}


@pytest.mark.parametrize("spoil", SPOIL.values(), ids=SPOIL.keys())
def test_a_damaged_or_foreign_file_costs_one_line_and_is_made_anew(used, spoil):
    used()
    spoil(files()[0])
    hits, (line,) = used()
    assert hits == 1 and line.startswith("pneumo: ") and "damaged or foreign; compiled again" in line
    assert used() == (2, [])


def test_each_version_of_python_has_its_own_files_and_its_patches_share_them(used, monkeypatch):
    used()
    for version, hits in (((*sys.version_info[:2], 99), 2), ((sys.version_info[0], 99, 0), 0)):
        monkeypatch.setattr(compiled, "sys", SimpleNamespace(version_info=version, stderr=sys.stderr))
        assert used() == (hits, [])


@pytest.mark.parametrize(
    ("chosen", "folder"),
    [
        ({"NUMBA_CACHE_DIR": "/chosen", "XDG_CACHE_HOME": "/caches"}, "/chosen"),
        ({"XDG_CACHE_HOME": "/caches"}, "/caches/pneumo"),
        ({}, "/home/someone/.cache/pneumo"),
    ],
)
def test_the_folder_is_where_the_user_wants_it(chosen, folder, monkeypatch):
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in (chosen | {"HOME": "/home/someone"}).items():
        monkeypatch.setenv(name, value)
    assert cache_folder("pneumo.errors").parent == Path(folder)


@pytest.mark.parametrize(
    ("system", "owner", "mode", "ours"),
    [
        ("posix", 1000, 0o755, True),
        ("posix", 999, 0o700, False),
        ("posix", 1001, 0o700, False),
        ("posix", 1000, 0o720, False),
        ("posix", 1000, 0o702, False),
        ("nt", 999, 0o777, True),  # Windows has neither owners nor modes of this kind
    ],
)
def test_only_what_no_other_user_can_have_written_is_ours(system, owner, mode, ours, monkeypatch):
    monkeypatch.setattr(compiled, "os", SimpleNamespace(name=system, geteuid=lambda: 1000))
    assert compiled._only_ours(SimpleNamespace(st_uid=owner, st_mode=mode)) == ours


@pytest.mark.parametrize("home", ["/dev/null", "/proc/nowhere", "a file"])
def test_without_a_folder_to_write_to_each_process_compiles(used, home, tmp_path, monkeypatch):
    (tmp_path / "a file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / home))
    for _ in range(2):
        hits, (line,) = used()
        assert hits == 0 and "compiled code is not kept there" in line


def test_a_user_without_a_home_compiles(used, monkeypatch):
    def nowhere(_path):
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "expanduser", nowhere)
    hits, lines = used()
    assert hits == 0 and len(lines) == 1


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES])
def test_a_full_or_read_only_home_costs_one_line(used, number, monkeypatch):
    class Full:
        name = ""

        def __init__(self, dir: Path, **_options):
            self.name = str(dir / "part")
            Path(self.name).touch()

        def __enter__(self):
            return self

        def __exit__(self, *_error):
            pass

        def write(self, _content):
            raise OSError(number, os.strerror(number))

    monkeypatch.setattr(compiled, "NamedTemporaryFile", Full)
    hits, (line,) = used()
    assert hits == 0 and os.strerror(number) in line and files() == []
