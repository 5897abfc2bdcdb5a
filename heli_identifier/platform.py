"""What differs between POSIX and Windows; no other module asks which system this is.

On Windows fcntl and resource do not exist, nor do fork, SIGHUP and masks of signals, and a file that is open can be
neither removed nor replaced. Each function here has an equal there, or says what is missing.
"""

import faulthandler
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from math import ceil
from pathlib import Path
from threading import Thread
from time import process_time, sleep
from typing import TYPE_CHECKING, Any, Literal, NoReturn

if TYPE_CHECKING:
    from subprocess import Popen

try:
    import fcntl
    import resource

    _IS_POSIX = True
except ImportError:
    _IS_POSIX = False

ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGINT", "SIGBREAK") if hasattr(signal, name))
"""Signals that ask a command to end: SIGHUP on POSIX only, SIGBREAK (Ctrl-Break) on Windows only."""

NEW_GROUP: dict[str, Any] = (
    {"creationflags": 0x200} if sys.platform == "win32" else {"start_new_session": True}  # CREATE_NEW_PROCESS_GROUP
)
"""Options of Popen for a process that does not hear Ctrl-C."""

NO_WAIT = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)
"""Flags to open a pipe without a wait for its other end, and a terminal without becoming its process."""

HOLDER = ".held"
"""Ending of the file beside a draft that its process keeps open on Windows."""

_OUT_OF_MEMORY, _NO_END = 3, 4  # exit codes of a process that reads

_PR_SET_PDEATHSIG = 1  # of Linux' <sys/prctl.h>


# --- drafts ----------------------------------------------------------------------------------------------------------


class Hold:
    """A draft of this process, which nobody else removes.

    POSIX: a lock (flock) on the draft. Windows: a file beside it that is open, so that it cannot be removed.
    """

    def __init__(self, path: Path, descriptor: int) -> None:
        self._path = path
        self._descriptor: int | None = descriptor

    def release(self) -> None:
        """Let others remove the draft; twice does no harm."""
        if self._descriptor is None:
            return
        descriptor, self._descriptor = self._descriptor, None
        os.close(descriptor)
        if not _IS_POSIX:
            with suppress(OSError):
                _holder(self._path).unlink()


def hold_new(path: Path, make: Callable[[Path], object]) -> Hold | None:
    """Make a draft and hold it; None if another process has removed it meanwhile."""
    if not _IS_POSIX:
        hold = Hold(path, os.open(_holder(path), os.O_RDWR | os.O_CREAT | os.O_EXCL))
        try:
            make(path)
        except BaseException:
            hold.release()
            raise
        return hold
    make(path)
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    if _lock(descriptor, path) is not False:
        return Hold(path, descriptor)
    os.close(descriptor)
    return None


def remove_if_left(path: Path, remove: Callable[[Path], object]) -> None:
    """Remove a draft of this user that no process holds.

    Raises
    ------
    OSError
        It is somebody else's, is held (Windows), or is gone.
    """
    if not _IS_POSIX:
        draft = Path(str(path).removesuffix(HOLDER))
        _holder(draft).unlink(missing_ok=True)  # refused while its process has it open
        remove(draft)
        return
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        if os.fstat(descriptor).st_uid == os.geteuid() and _lock(descriptor, path):
            remove(path)
    finally:
        os.close(descriptor)


def _holder(path: Path) -> Path:
    return Path(f"{path}{HOLDER}")


def _lock(descriptor: int, path: Path) -> bool | None:
    """Lock a draft: False if another process holds or has removed it, None where files have no locks."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return os.path.samestat(os.fstat(descriptor), os.lstat(path))
    except (BlockingIOError, FileNotFoundError):
        return False
    except OSError:
        return None


# --- processes -------------------------------------------------------------------------------------------------------


@contextmanager
def unheard(number: signal.Signals) -> Iterator[None]:
    """Hold a signal back in the block; processes that are started in it never hear it (Windows: see NEW_GROUP)."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [number])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_process(process: "Popen[bytes]") -> None:
    """End a process and wait for its end; on POSIX Popen.wait would wait for itself where a signal interrupted it."""
    process.kill()
    if _IS_POSIX:
        with suppress(ChildProcessError):
            os.waitpid(process.pid, 0)
    else:
        process.wait()


def end_with_parent(parent: int) -> None:
    """Let this process end when the process ``parent`` that started it ends, however that ends."""
    if _IS_POSIX and sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it ended before that was arranged
            os._exit(0)
    else:
        Thread(target=_wait_for_end, args=(parent,), daemon=True).start()


def _wait_for_end(parent: int) -> None:
    """Wait for the end of the parent, then end this process."""
    if sys.platform == "win32":
        import ctypes

        kernel = ctypes.WinDLL("kernel32")
        kernel.OpenProcess.restype = ctypes.c_void_p
        kernel.WaitForSingleObject.argtypes = (ctypes.c_void_p, ctypes.c_uint32)
        kernel.WaitForSingleObject(kernel.OpenProcess(0x00100000, False, parent), 0xFFFFFFFF)  # SYNCHRONIZE, for ever
    else:
        while os.getppid() == parent:
            sleep(0.5)
    os._exit(0)


# --- bounds ----------------------------------------------------------------------------------------------------------


def memory_limits() -> list[tuple[int, str]]:
    """Give the limits of this process's memory [bytes] with the commands that set them; Windows has none."""
    if not _IS_POSIX:
        return []
    kinds = ((resource.RLIMIT_AS, "ulimit -v"), (resource.RLIMIT_DATA, "ulimit -d"))
    found = [(resource.getrlimit(kind)[0], name) for kind, name in kinds]
    return [(limit, name) for limit, name in found if limit != resource.RLIM_INFINITY]


def run_bounded(
    read: Callable[[], object], patience: float, waited: float, memory: int
) -> Literal["", "crash", "no end", "out of memory"]:
    """Run a reader in a process of its own, and say how that failed; an exception of the reader is no failure.

    POSIX: a forked copy of this process under limits of the system. Windows: a new process, to which `read` is pickled;
    it watches its own time, and its memory is not bounded.

    Parameters
    ----------
    read : callable
        What it gives or raises does not matter.
    patience, waited : float
        Longest time it may compute, and that may pass by the clock [s].
    memory : int
        What it may take beyond what this process has [bytes].
    """
    if _IS_POSIX:
        child = os.fork()
        if child == 0:
            _read_and_leave(read, lambda: _limit(patience, waited, memory))
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        no_end = code in (-signal.SIGXCPU, -signal.SIGALRM)
    else:
        from multiprocessing import get_context

        process = get_context("spawn").Process(target=_read_in_time, args=(read, patience), daemon=True)
        process.start()
        process.join(waited)
        no_end = process.is_alive()
        if no_end:
            process.kill()
            process.join()
        code = process.exitcode or 0
        no_end = no_end or code == _NO_END
    if no_end:
        return "no end"
    return "" if code == 0 else "out of memory" if code == _OUT_OF_MEMORY else "crash"


def _read_in_time(read: Callable[[], object], patience: float) -> NoReturn:
    """Read in a new process."""

    def watch() -> None:
        bound = process_time() + patience
        while process_time() < bound:
            sleep(min(0.1, patience))
        os._exit(_NO_END)

    _read_and_leave(read, Thread(target=watch, daemon=True).start)


def _read_and_leave(read: Callable[[], object], bound: Callable[[], object]) -> NoReturn:
    """Read in the child, without a word, and end it without any of the parent's cleaning up."""
    code = 0
    try:
        faulthandler.disable()  # a crash of the reader is an answer here, not news
        nothing = os.open(os.devnull, os.O_RDWR)
        for descriptor in (0, 1, 2):
            os.dup2(nothing, descriptor)
        bound()
        read()
    except MemoryError:
        code = _OUT_OF_MEMORY
    except BaseException:  # the parent meets it as well, and says it
        code = 0
    finally:
        os._exit(code)


def _limit(patience: float, waited: float, memory: int) -> None:
    """Bound a forked process."""
    for number in (*ENDING, signal.SIGXCPU, signal.SIGALRM):
        signal.signal(number, signal.SIG_DFL)
    held = 0  # where there is no /proc, as on macOS, it is little beside the bound
    with suppress(OSError):
        held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    _lower(resource.RLIMIT_CORE, 0)  # no image of a crashed reader is left behind
    _lower(resource.RLIMIT_CPU, ceil(patience))
    with suppress(ValueError, OSError):  # macOS may refuse to bound the memory
        _lower(resource.RLIMIT_AS, held + memory)
    signal.setitimer(signal.ITIMER_REAL, waited)


def _lower(limit: int, bound: int) -> None:
    """Lower a limit of this process to ``bound`` unless it is lower."""
    now, hard = resource.getrlimit(limit)
    resource.setrlimit(limit, (bound if now == resource.RLIM_INFINITY else min(now, bound), hard))
