"""Lets something happen before each call of the file system: a kill, or an error."""

import builtins
import io
import itertools
import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from unittest import mock

CALLS = ["chmod", "fsync", "link", "listdir", "lstat", "mkdir", "open", "rename", "rmdir"]
CALLS += ["scandir", "stat", "symlink", "unlink", "utime", "write"]
KILLED = 9
HOUR = 3600.0  # s


class Torn:
    """A file of which one half is written before something happens."""

    def __init__(self, file, act: Callable[[], None]):
        self.file, self.act = file, act

    def __getattr__(self, name):
        return getattr(self.file, name)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()

    def write(self, content):
        """Write one half, let something happen, and write the other half."""
        half = len(content) // 2
        self.file.write(content[:half])
        self.file.flush()
        self.act()
        self.file.write(content[half:])


@contextmanager
def before_calls(act: Callable[[], None], *others: tuple[object, str]) -> Iterator[None]:
    """Call ``act()`` before each call of the file system and of other functions of modules."""

    def before(function):
        def called(*arguments, **options):
            act()
            return function(*arguments, **options)

        if function in os.supports_follow_symlinks:  # which shutil looks up
            os.supports_follow_symlinks.add(called)
        return called

    def opened(path, mode="r", *arguments, **options):
        act()
        file = plain(path, mode, *arguments, **options)
        return Torn(file, act) if set("wxa") & set(mode) else file

    plain = open
    with ExitStack() as patches:
        for owner in (io, builtins):
            patches.enter_context(mock.patch.object(owner, "open", opened))
        for owner, name in (*((os, name) for name in CALLS), *others):
            patch = mock.patch.object(owner, name, before(getattr(owner, name)))
            patches.enter_context(patch)
        yield


def at(moment: int, act: Callable[[], None]) -> Callable[[], None]:
    """Return a function that acts at the call of that number; calls count from 0."""
    count = itertools.count()

    def call():
        if next(count) == moment:
            act()

    return call


def fault(code: int) -> Callable[[], None]:
    """Return a function that raises the error of a failing system."""

    def fail():
        raise OSError(code, os.strerror(code))

    return fail


def killed_at(moment: int, work: Callable[[], object], *others: tuple[object, str]) -> bool:
    """Do some work in a process that is killed at a call; tell whether that call was reached."""
    child = os.fork()
    if child == 0:
        with before_calls(at(moment, lambda: os._exit(KILLED)), *others):
            work()
        os._exit(0)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert status in (0, KILLED), f"the child ended with {status} at call {moment}"
    return status == KILLED


def age(folder: Path) -> None:
    """Make the contents of a folder more than an hour older."""
    then = time.time() - 2 * HOUR
    for path in folder.iterdir():
        os.utime(path, (then, then), follow_symlinks=False)
