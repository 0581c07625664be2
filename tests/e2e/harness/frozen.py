"""Threads of a program that stand still while the others go on."""
import contextlib
import ctypes
import os
import pathlib

PTRACE_DETACH, PTRACE_SEIZE, PTRACE_INTERRUPT = 17, 0x4206, 0x4207
WALL = 0x40000000  # waitpid: for threads, too

_libc = ctypes.CDLL(None, use_errno=True)
_libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]


def _ptrace(request, thread):
    if _libc.ptrace(request, thread, None, None) != 0:
        code = ctypes.get_errno()
        raise OSError(code, os.strerror(code), f"thread {thread}")


def _named(pid, name):
    """Of those that do not end meanwhile."""
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            if (task / "comm").read_text().strip() == name:
                yield int(task.name)


def _freeze(thread, thawing):
    """False: it has ended."""
    try:
        _ptrace(PTRACE_SEIZE, thread)
    except ProcessLookupError:
        return False
    thawing.callback(_ptrace, PTRACE_DETACH, thread)
    _ptrace(PTRACE_INTERRUPT, thread)
    os.waitpid(thread, WALL)
    return True


@contextlib.contextmanager
def frozen(pid, name):
    """Freezes the threads of that name (as the kernel knows it) until the end of the block."""
    with contextlib.ExitStack() as thawing:
        frozen_threads = [thread for thread in _named(pid, name) if _freeze(thread, thawing)]
        assert frozen_threads, f"{name}: no such thread"
        yield
