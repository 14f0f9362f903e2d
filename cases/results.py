"""Folders of results: one process owns each at a time, and an earlier result stands until the new
one is complete, whatever ends the run.

All that a command makes is prepared in a scratch folder on the same file system, and takes its
place in one go. Files that the command does not call its own stay, whoever put them there.
"""

import ctypes
import errno
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from cases import room
from cases.errors import CaseError, EngineError, Failed
from cases.scratch import locked, made_folders, reason, scratch, told
from cases.unfinished import Unfinished, unfinished

CURRENT_FOLDER, EXCHANGE = -100, 2  # AT_FDCWD and RENAME_EXCHANGE of renameat2(2)


@contextmanager
def owned(out: Path, needs: float = 0.0) -> Iterator["Folder"]:
    """The folder `out`, which need not be there yet, for this process alone.

    Raises CaseError where it cannot be one of results, or is in use; EngineError where it `needs`
    more room than there is [bytes].
    """
    real = place_of(out)
    room.refuse_lack(out, needs)
    with ExitStack() as stack:
        with told(out):
            stack.enter_context(made_folders(real.parent))
            home = home_of(real)
            stack.enter_context(locked(home / f".{real.name}.lock", out))
            if real.exists():
                tempfile.TemporaryFile(dir=real).close()  # a folder that can be written to
            folder = Folder(out, real, home)
            with folder.scratch():  # its name fits as well
                pass
        yield folder


@contextmanager
def prepared(out: Path, ours: Iterable[str] = (), needs: float = 0.0) -> Iterator[Path]:
    """A folder to make results in, which take their place in `out` at the end (Folder.prepare)."""
    with owned(out, needs) as folder, folder.prepare(ours) as work:
        yield work


def place_of(out: Path) -> Path:
    """Where a folder of results really is, or will be. Raises CaseError where none can be."""
    try:
        mode = out.stat().st_mode
    except FileNotFoundError:
        if out.is_symlink():
            raise CaseError(
                f"{out}: no folder for results (a link to {os.readlink(out)}, which is not there) "
                "remove the link, or choose another place"
            ) from None
    except OSError as error:
        raise CaseError(
            f"{out}: no folder for results ({reason(error)}) choose another place"
        ) from error
    else:
        if not stat.S_ISDIR(mode):
            raise CaseError(f"{out}: no folder for results (it is a file) choose another place")
    real = out.resolve()
    if not real.name:
        raise CaseError(f"{out}: no folder for results (the root of all) choose another place")
    return real


def home_of(real: Path) -> Path:
    """Where lock and scratch folders lie: beside the folder; inside where it is a file system of
    its own, or nothing can be put beside it.
    """
    above = real.parent
    apart = real.exists() and real.stat().st_dev != above.stat().st_dev
    beside = os.access(above, os.W_OK | os.X_OK)
    return real if apart or (real.exists() and not beside) else above


@dataclass(frozen=True)
class Folder:
    """A folder that this process owns."""

    out: Path  # as it was named
    real: Path
    home: Path  # of scratch folders

    def scratch(self):
        return scratch(self.home, self.real.name)

    def half_way(self) -> Path:
        """Where results are that somebody may go on with."""
        return self.home / f".{self.real.name}.unfinished"

    @contextmanager
    def prepare(
        self,
        ours: Iterable[str] = (),
        borrow: Iterable[str] = (),
        goes_on: Unfinished | None = None,
    ) -> Iterator[Path]:
        """A folder to make results in, which take their place once the block has ended well.

        `ours` are the names, or patterns of them, that the new results replace as a whole; of
        everything else a file stays unless a new one has its name. Files that match `borrow` are
        there to read from the start. What `goes_on` is kept where the block is interrupted.
        """
        with ExitStack() as stack:
            stack.enter_context(room.enough(self.out))
            with told(self.out):
                work = stack.enter_context(
                    unfinished(self.half_way(), self.out, goes_on) if goes_on else self.scratch()
                )
                links = [link for pattern in borrow for link in self.borrow(pattern, work)]
            try:
                yield work
            except Failed as error:  # as the user knows the place
                line = str(error).replace(str(work), str(self.out))
                raise type(error)(line, None) from error
            for link in links:
                if link.is_symlink():  # and no new file of that name
                    link.unlink()
            for file in work.rglob("*"):
                if file.is_file() and not file.is_symlink():
                    room.settle(file)
            self.swap(work, tuple(ours))

    def borrow(self, pattern: str, work: Path) -> list[Path]:
        """Links in `work` to files of the folder."""
        links = []
        for file in self.real.glob(pattern):
            link = work / file.relative_to(self.real)
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(file)
            links.append(link)
        return links

    def swap(self, work: Path, ours: tuple[str, ...]):
        """Raises EngineError, which says where the new results are, when they cannot take their
        place.
        """
        try:
            if not self.real.exists():
                os.rename(work, self.real)
            elif not (
                self.in_one_go() and keep(self.real, work, ours) and exchanged(work, self.real)
            ):
                replace_each(self.real, work, work.with_name("old"), ours)
        except OSError as error:
            kept = self.rescue(work, "new")
            raise EngineError(
                f"{self.out}: cannot be replaced ({reason(error)}) the new results are in {kept}"
            ) from error

    @contextmanager
    def rescued(self, work: Path, word: str) -> Iterator[None]:
        """What is in `work` is kept beside the folder when the block fails, and said to be there:
        for what took long and is whole before the block. What is gone on with stays where it is
        when it is interrupted.
        """
        try:
            yield
        except BaseException as error:
            failed = isinstance(error, Failed)
            if not failed and work.is_relative_to(self.half_way()):
                raise
            kept = self.rescue(work, word)
            said = f"the engines' results are in {kept}"
            if failed:
                raise type(error)(f"{error}; {said}") from error
            print(f"{self.out}: not replaced; {said}", file=sys.stderr)
            raise

    def in_one_go(self) -> bool:
        """Whether the folder itself may be another one afterwards: not where we, and so the shell
        that called us, stand in it, nor where the scratch folders do.
        """
        try:
            within = Path.cwd().is_relative_to(self.real)
        except FileNotFoundError:  # where we stood is no more
            within = False
        return self.home != self.real and not within

    def rescue(self, work: Path, word: str) -> Path:
        """Moves what was made out of the scratch folder; returns where it is."""
        number, target = 1, self.home / f"{self.real.name}-{word}"
        while target.exists():
            number += 1
            target = target.with_name(f"{self.real.name}-{word}-{number}")
        os.rename(work, target)
        return target


def is_ours(place: str, ours: tuple[str, ...]) -> bool:
    return any(fnmatchcase(place, pattern) for pattern in ours)


def keep(old: Path, new: Path, ours: tuple[str, ...], inside: str = "") -> bool:
    """Links into `new` all that is to stay of `old`; False where the file system has no links."""
    shutil.copymode(old, new)
    for entry in os.scandir(old):
        place, target = f"{inside}{entry.name}", new / entry.name
        if is_ours(place, ours):
            continue
        if entry.is_dir(follow_symlinks=False):
            if target.is_dir() or not os.path.lexists(target):
                target.mkdir(exist_ok=True)
                if not keep(Path(entry.path), target, ours, f"{place}/"):
                    return False
        elif not os.path.lexists(target):
            try:
                os.link(entry.path, target, follow_symlinks=False)
            except OSError:
                return False
    return True


def exchanged(one: Path, other: Path) -> bool:
    """Gives two folders each other's name, at once; False where the system cannot."""
    call = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if call is None:
        return False
    if call(CURRENT_FOLDER, os.fsencode(one), CURRENT_FOLDER, os.fsencode(other), EXCHANGE) == 0:
        return True
    code = ctypes.get_errno()
    if code in (errno.ENOSYS, errno.EINVAL, errno.EXDEV):
        return False
    raise OSError(code, os.strerror(code), str(other))


def replace_each(old: Path, new: Path, aside: Path, ours: tuple[str, ...], inside: str = ""):
    """Moves each new file to its place, and what it replaces `aside`."""
    aside.mkdir()
    entries = sorted(os.scandir(new), key=lambda entry: entry.name)
    named = {entry.name for entry in entries}
    for entry in entries:
        place, target = f"{inside}{entry.name}", old / entry.name
        folders = entry.is_dir(follow_symlinks=False) and target.is_dir()
        if folders and not is_ours(place, ours):
            replace_each(target, Path(entry.path), aside / entry.name, ours, f"{place}/")
            continue
        if os.path.lexists(target):
            os.rename(target, aside / entry.name)
        os.rename(entry.path, target)
    for entry in list(os.scandir(old)):
        if is_ours(f"{inside}{entry.name}", ours) and entry.name not in named:
            os.rename(entry.path, aside / entry.name)
