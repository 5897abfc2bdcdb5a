"""Processes: the signals that end one, its clean-up, and functions that are called in a separate one.

Within a block of :func:`clean_up_on_signals`, SIGTERM, SIGHUP and Ctrl-C end the process from within their handler: it
calls what :func:`undo_at_end` has registered, and exits with 128 plus the signal's number, as a shell does. An
exception would not be enough: Python drops one that a signal raises within the callback of a weak reference or a
``__del__``, and a library may swallow or replace it.

All differences between POSIX and Windows are in this module. Windows has no resource and no SIGHUP, and an open file
can be neither removed nor replaced there.
"""

import faulthandler
import os
import pickle
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen, TimeoutExpired
from threading import RLock, Thread, current_thread, main_thread
from types import FrameType
from typing import Any, NoReturn

try:
    import resource

    _IS_POSIX = True
except ImportError:
    _IS_POSIX = False

_NEW_GROUP: dict[str, Any] = (  # options of Popen for a process that does not receive Ctrl-C
    {"creationflags": 0x200} if sys.platform == "win32" else {"start_new_session": True}  # CREATE_NEW_PROCESS_GROUP
)
_LONGEST_WAIT = None if _IS_POSIX else 0.5  # for another process [s]: on Windows Ctrl-C has no effect during a wait
_ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGINT", "SIGBREAK") if hasattr(signal, name))

_to_undo: list[Callable[[], object]] = []
_to_begin = RLock()  # a process that ends keeps it, so that its other threads begin nothing more


@contextmanager
def undo_at_end(undo: Callable[[], object]) -> Iterator[None]:
    """Call ``undo`` when the block ends or a signal ends the process within it; calling it twice must do no harm."""
    with _to_begin:
        _to_undo.append(undo)
    try:
        yield
    finally:
        undo()
        _to_undo.remove(undo)


@contextmanager
def clean_up_on_signals() -> Iterator[None]:
    """While the block runs, let the signals that ask a command to end clean up and end the process at once.

    A signal that is ignored stays ignored: SIGHUP under nohup, Ctrl-C in the background.
    """
    previous = {}
    if current_thread() is main_thread():  # Python handles signals only there
        handlers = {number: signal.getsignal(number) for number in _ENDING}
        previous = {number: handler for number, handler in handlers.items() if handler not in (signal.SIG_IGN, None)}
    for number in previous:
        signal.signal(number, _end)
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def _end(number: int, _frame: FrameType | None) -> None:
    for ending in _ENDING:  # a second signal would interrupt the clean-up
        signal.signal(ending, signal.SIG_IGN)
    _to_begin.acquire()
    for undo in _to_undo[::-1]:  # a copy, since other threads remove what ends
        with suppress(Exception):
            undo()
    os._exit(128 + number)


class NoAnswer(Exception):
    """A separate process has ended without an answer: how, and the last line that it has printed."""


restart_watchdog: Callable[[], object] = int  # does nothing
"""Let a function of :func:`call_apart` take its whole patience once more; it does nothing in other processes."""


def call_apart(
    folder: Path, function: Callable[..., Any], *arguments: Any, error: type[Exception], patience: float,
    memory: int | None = None, shows_errors: bool = False,
) -> Any:  # fmt: skip
    """Call a function in a separate process, which may crash or hang; return its result or raise its ``error``.

    What the process prints is dropped, but for its error stream if ``shows_errors``. It ends when this process ends, if
    it works for longer than ``patience`` [s], or if it needs ``memory`` [bytes] beyond what it has; if it gives no
    answer, NoAnswer is raised. Its temporary files are in ``folder``, which is for this call alone.
    """
    (folder / "order").write_bytes(pickle.dumps((function, arguments, error, patience, memory)))
    # This package is found where it is now; the user's folder (-P) and that of his script may have files called alike.
    place = str(Path(__file__).parents[1])
    search = f"import sys; {place!r} in sys.path or sys.path.insert(0, {place!r})"
    with (
        open(folder / "errors", "wb") as errors,
        Popen(
            [sys.executable, "-P", "-c", f"{search}; from {__name__} import _answer; _answer()", str(folder)],
            stdin=PIPE,  # ends with this process, and then the child does
            stdout=DEVNULL,
            stderr=None if shows_errors else errors,
            env={**os.environ, "TMPDIR": str(folder)},
            **_NEW_GROUP,  # Ctrl-C is for this process, which then ends the child
        ) as process,
        undo_at_end(partial(_end_process, process)),
    ):
        while process.returncode is None:
            with suppress(TimeoutExpired):
                process.wait(_LONGEST_WAIT)
    if (folder / "answer").is_file():
        answer = pickle.loads((folder / "answer").read_bytes())
        if isinstance(answer, error):
            raise answer
        return answer
    code, hung = process.returncode, folder / "hung"
    how = f"ended with code {code} and no result"
    if hung.is_file() and hung.stat().st_size > 0:
        how = f"gave no answer within {patience:g} s and was ended"
    elif code < 0:
        how = f"was ended by signal {-code} ({signal.strsignal(-code)})"
    printed = (folder / "errors").read_text("utf-8", "replace").strip().splitlines()
    raise NoAnswer(how, printed[-1][:300] if printed else "it printed no error")


def _answer() -> NoReturn:
    """Call the function in the separate process, whose first argument is the folder of the order and the answer.

    It leaves by ``os._exit``, because libraries may crash at the end of the interpreter.
    """
    global restart_watchdog
    Thread(target=lambda: os._exit(len(os.read(0, 1))), daemon=True).start()  # as soon as the parent has ended
    folder = Path(sys.argv[1])
    function, arguments, expected, patience, memory = pickle.loads((folder / "order").read_bytes())
    if memory is not None:
        _bound_memory(memory)
    with open(folder / "hung", "w") as hung:
        restart_watchdog = partial(faulthandler.dump_traceback_later, patience, exit=True, file=hung)
        restart_watchdog()
        try:
            answer = function(*arguments)
        except expected as error:
            answer = error
        faulthandler.cancel_dump_traceback_later()
    with open(folder / "draft", "wb") as file:
        pickle.dump(answer, file, protocol=pickle.HIGHEST_PROTOCOL)
    os.replace(folder / "draft", folder / "answer")
    sys.stderr.flush()
    os._exit(0)


def _end_process(process: "Popen[bytes]") -> None:
    """Kill a process and wait for its end; on POSIX Popen.wait would deadlock if a signal had interrupted it."""
    process.kill()
    if _IS_POSIX:
        with suppress(ChildProcessError):
            os.waitpid(process.pid, 0)
    else:
        process.wait()


def _bound_memory(more: int) -> None:
    """Let this process take at most ``more`` bytes beyond its present memory and no core dump; not on Windows."""
    if not _IS_POSIX:
        return
    present = 0  # without /proc, as on macOS: it is small compared with the bound
    with suppress(OSError):
        present = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    for kind, bound in ((resource.RLIMIT_AS, present + more), (resource.RLIMIT_CORE, 0)):
        soft, hard = resource.getrlimit(kind)
        with suppress(ValueError, OSError):  # macOS may refuse to bound the memory
            resource.setrlimit(kind, (bound if soft == resource.RLIM_INFINITY else min(soft, bound), hard))
