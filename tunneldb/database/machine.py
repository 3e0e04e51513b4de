"""Settings of the embedded server, sized to the machine."""

from __future__ import annotations

import os
import sys
from pathlib import Path

MIB = 1024 * 1024


def memory_bytes() -> int:
    """Return the memory that this machine, or the container, may use."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    for limit in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        try:
            text = Path(limit).read_text().strip()
        except OSError:
            continue
        if text.isdigit():
            memory = min(memory, int(text))
    return memory


def cores() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def settings(socket_dir: Path) -> dict[str, str]:
    """Return the settings of an embedded server on this machine.

    One user, few connections, big scans: a quarter of the memory for shared buffers, generous work_mem. Locks for
    tens of thousands of kilometres: a dump takes one for each, removing a survey takes six for each of its kilometres.
    ``wal_level=minimal`` lets COPY into a table of the same transaction skip the WAL; jit costs more than it
    gains on the short functions of tunnel_api.
    """
    memory = memory_bytes()
    workers = max(1, cores() - 1)
    chosen = {
        "listen_addresses": "''",
        "unix_socket_directories": "'" + str(socket_dir).replace("'", "''") + "'",
        "unix_socket_permissions": "0700",
        "port": "5432",
        "max_connections": "100",
        "max_locks_per_transaction": "1024",
        "shared_buffers": _mib(memory // 4, 128, 4096),
        "effective_cache_size": _mib(memory // 2, 256, 1024 * 1024),
        "work_mem": _mib(memory // 64, 16, 256),
        "maintenance_work_mem": _mib(memory // 16, 64, 1024),
        "max_worker_processes": str(max(8, 2 * cores())),
        "max_parallel_workers": str(cores()),
        "max_parallel_workers_per_gather": str(min(4, workers)),
        "max_parallel_maintenance_workers": str(min(4, workers)),
        "wal_level": "minimal",
        "max_wal_senders": "0",
        "max_wal_size": "4GB",
        "checkpoint_timeout": "15min",
        "random_page_cost": "1.1",
        "jit": "off",
        "dynamic_shared_memory_type": _shared_memory_type(),
        "password_encryption": "scram-sha-256",
        "timezone": "'UTC'",
        "log_timezone": "'UTC'",
        "log_line_prefix": "'%m [%p] %u '",
    }
    if sys.platform == "linux":
        chosen["effective_io_concurrency"] = "200"
    return chosen


def _mib(size: int, minimum: int, maximum: int) -> str:
    return f"{min(max(size // MIB, minimum), maximum)}MB"


def _shared_memory_type() -> str:
    """Return the method by which parallel workers share memory: containers often have only 64 MB of /dev/shm."""
    try:
        space = os.statvfs("/dev/shm")
    except OSError:
        return "posix" if sys.platform == "darwin" else "mmap"
    return "posix" if space.f_blocks * space.f_frsize >= 1024 * MIB else "mmap"
