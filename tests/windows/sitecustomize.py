"""What Windows lacks, taken away from Python on Linux: `PYTHONPATH=tests/windows python -m pytest ...`.

As `sitecustomize` it also acts in every Python process that the tests start. What it imitates:

* the modules fcntl, resource, pwd, grp, termios and tty cannot be imported;
* os.fork, killpg, setsid, mkfifo, fchmod, O_NONBLOCK, O_NOFOLLOW, O_CLOEXEC and O_NOCTTY do not exist;
* of the signals there are SIGINT, SIGTERM, SIGABRT, SIGFPE, SIGILL and SIGSEGV; no masks, timers or alarms;
* a folder cannot be opened by os.open;
* a file that any process has open cannot be removed, renamed or replaced; os.rename replaces nothing;
* text files without an encoding, and the standard streams, are cp1252;
* multiprocessing spawns.

Not imitated: os.getuid is there (libraries take it where sys.platform is linux), sys.platform and os.name, backslashes
and drives, names that ignore case, reserved names (con, nul), paths of more than 260 characters.
"""

import builtins
import errno
import io
import multiprocessing
import os
import shutil  # noqa: F401  # the standard library itself is loaded before its functions are taken away
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress

with suppress(ImportError):  # these take what Windows lacks where sys.platform is linux
    import locket  # noqa: F401
    import psutil  # noqa: F401

_replace, _rename, _unlink, _open_descriptor, _open = os.replace, os.rename, os.unlink, os.open, io.open


def _held(path):
    """Whether any process has the file open."""
    place = os.path.realpath(path)
    for process in filter(str.isdigit, os.listdir("/proc")):
        with suppress(OSError):
            for number in os.listdir(f"/proc/{process}/fd"):
                with suppress(OSError):
                    if (at := os.readlink(f"/proc/{process}/fd/{number}")) == place or at.startswith(f"{place}/"):
                        return True
    return False


def _refuse(path):
    if isinstance(path, (str, bytes, os.PathLike)) and _held(os.fsdecode(path)):
        raise PermissionError(errno.EACCES, "the file is open in a process", os.fsdecode(path))


def replace(source, target, **options):
    """os.replace, refused for what is open."""
    _refuse(source)
    _refuse(target)
    _replace(source, target, **options)


def rename(source, target, **options):
    """os.rename, refused for what is open or stands in the way."""
    _refuse(source)
    if os.path.lexists(target):
        raise FileExistsError(errno.EEXIST, "the file exists", os.fsdecode(target))
    _rename(source, target, **options)


def unlink(path, **options):
    """os.unlink, refused for what is open."""
    if "dir_fd" not in options and sys._getframe(1).f_code.co_filename != tempfile.__file__:
        _refuse(path)
    _unlink(path, **options)


def open_descriptor(path, flags, *mode, **options):
    """os.open, refused for folders."""
    if os.path.isdir(path) and not sys._getframe(1).f_code.co_filename.endswith(("shutil.py", "os.py")):
        raise PermissionError(errno.EACCES, "it is a folder", os.fsdecode(path))
    return _open_descriptor(path, flags, *mode, **options)


def open_file(file, mode="r", buffering=-1, encoding=None, *others, **options):
    """Open a file; text is cp1252 unless it is said to be something else."""
    if "b" not in mode and encoding in (None, "locale"):
        encoding = "cp1252"
    return _open(file, mode, buffering, encoding, *others, **options)


os.replace, os.rename, os.unlink, os.remove, os.open = replace, rename, unlink, unlink, open_descriptor
builtins.open = io.open = open_file
io.text_encoding = lambda encoding, level=2: "cp1252" if encoding is None else encoding
for stream in (sys.stdin, sys.stdout, sys.stderr):
    if stream is not None and "PYTHONIOENCODING" not in os.environ:
        stream.reconfigure(encoding="cp1252")

for name in ("fcntl", "resource", "pwd", "grp", "termios", "tty"):
    sys.modules[name] = None
subprocess.Popen.kill = lambda self: self.send_signal(9)
multiprocessing.process.BaseProcess.kill = lambda self: os.kill(self.pid, 9)
multiprocessing.set_start_method("spawn")

KEPT = ("SIGINT", "SIGTERM", "SIGABRT", "SIGFPE", "SIGILL", "SIGSEGV", "SIG_DFL", "SIG_IGN")
for name in [name for name in vars(signal) if name.startswith(("SIG", "ITIMER")) and name not in KEPT]:
    delattr(signal, name)
for name in ("pthread_sigmask", "pthread_kill", "alarm", "setitimer", "getitimer", "pause", "sigwait"):
    delattr(signal, name)
for name in (
    "fork", "forkpty", "killpg", "getpgid", "setsid", "mkfifo", "fchmod",
    "O_NONBLOCK", "O_NOFOLLOW", "O_CLOEXEC", "O_NOCTTY", "WIFSIGNALED", "WTERMSIG", "WEXITSTATUS", "wait4",
):  # fmt: skip
    delattr(os, name)
