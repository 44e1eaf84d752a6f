"""Keep freed memory in the process: glibc otherwise returns it and pays for it every step."""

import ctypes
import platform

M_TRIM_THRESHOLD, M_MMAP_MAX = -1, -4
INT_MAX = 2**31 - 1


def keep_freed_memory() -> bool:
    """Serve large blocks from the heap and never trim it; True where that is possible.

    Training on a CPU allocates and frees the same large blocks at every step. By default glibc
    maps and unmaps them, and the page faults cost more than some of the mathematics.
    """
    if platform.libc_ver()[0] != "glibc":
        return False
    libc = ctypes.CDLL(None)
    return bool(libc.mallopt(M_MMAP_MAX, 0) and libc.mallopt(M_TRIM_THRESHOLD, INT_MAX))
