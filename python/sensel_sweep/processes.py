"""Starts other programs, and stops them where this one is asked to stop."""

from __future__ import annotations

import signal
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager

# How long a program may take to end by itself: a terminal's signal reaches it too, and a second one would end it before it has cleaned up.
GRACE_S = 1.0
# How long it may take after it was asked to end: a frame may have to be finished.
STOP_S = 20.0


class NoProgram(Exception):
    """A program that cannot be started, in one line."""


class Requests:
    """Signals that ask this program to stop. While a program is being started they wait, so that none is left behind."""

    def __init__(self):
        self.is_starting = False
        self.has_waiting = False

    def on_signal(self, *_) -> None:
        """Raises KeyboardInterrupt, now or once the program has started."""
        if self.is_starting:
            self.has_waiting = True
            return
        raise KeyboardInterrupt


REQUESTS = Requests()


@contextmanager
def stoppable() -> Iterator[None]:
    """SIGTERM and SIGHUP stop this program as SIGINT does. A signal that was ignored when it started, as by nohup, stays ignored."""
    usual = []
    if threading.current_thread() is threading.main_thread():
        # Windows has no SIGHUP.
        for number in (getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)):
            handler = signal.getsignal(number)
            if handler in (signal.SIG_DFL, signal.default_int_handler):
                usual.append((number, handler))
                signal.signal(number, REQUESTS.on_signal)
    try:
        yield
    finally:
        for number, handler in usual:
            signal.signal(number, handler)


def started(words: list[str], **streams) -> subprocess.Popen:
    """Starts a program without input."""
    REQUESTS.is_starting = threading.current_thread() is threading.main_thread()
    try:
        return subprocess.Popen(words, stdin=subprocess.DEVNULL, **streams)
    except OSError as error:
        raise NoProgram(f"{words[0]}: {error.strerror or error}") from None
    finally:
        REQUESTS.is_starting = False


def called(words: list[str], **streams) -> subprocess.CompletedProcess:
    """Runs a program to its end. One that is running when this program is asked to stop is stopped first."""
    child = started(words, **streams)
    try:
        if REQUESTS.has_waiting:
            REQUESTS.has_waiting = False
            raise KeyboardInterrupt
        said, complained = child.communicate()
    except BaseException:
        stop(child)
        raise
    return subprocess.CompletedProcess(words, child.returncode, said, complained)


def stop(child: subprocess.Popen) -> None:
    """Waits for a program to end by itself, asks it to, and at last kills it; a second request to stop kills it at once."""
    try:
        for ask, seconds in ((None, GRACE_S), (child.terminate, STOP_S)):
            if ask:
                ask()
            try:
                child.wait(seconds)
                return
            except subprocess.TimeoutExpired:
                continue
    except KeyboardInterrupt:
        pass
    child.kill()
    child.wait()
