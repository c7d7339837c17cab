"""The system calls that a submission cannot make, as a filter for the kernel (seccomp).

They make memory that no limit counts, or look into other processes. Everything else is left to the namespaces.
"""

from __future__ import annotations

import platform
import struct

REFUSED = {
    "x86_64": {
        "memfd_create": 319,
        "memfd_secret": 447,
        "shmget": 29,
        "semget": 64,
        "msgget": 68,
        "io_uring_setup": 425,
        "userfaultfd": 323,
        "bpf": 321,
        "add_key": 248,
        "request_key": 249,
        "keyctl": 250,
        "perf_event_open": 298,
        "ptrace": 101,
        "process_vm_readv": 310,
        "process_vm_writev": 311,
        "unshare": 272,
        "setns": 308,
    },
    "aarch64": {
        "memfd_create": 279,
        "memfd_secret": 447,
        "shmget": 194,
        "semget": 190,
        "msgget": 186,
        "io_uring_setup": 425,
        "userfaultfd": 282,
        "bpf": 280,
        "add_key": 217,
        "request_key": 218,
        "keyctl": 219,
        "perf_event_open": 241,
        "ptrace": 117,
        "process_vm_readv": 270,
        "process_vm_writev": 271,
        "unshare": 97,
        "setns": 268,
    },
}
"""Numbers of the calls on each processor, from the kernel's headers (asm/unistd.h)."""

ARCHITECTURES = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}
"""How the kernel names the processors (linux/audit.h)."""
OTHER_NUMBERS = 0x40000000
"""From here on the same calls have a second number on x86_64."""

LOAD, JUMP_EQUAL, JUMP_AT_LEAST, RETURN = 0x20, 0x15, 0x35, 0x06
NUMBER, ARCHITECTURE = 0, 4
"""Where a call's number and processor stand in what the filter is given."""
ALLOW, REFUSE, KILL = 0x7FFF0000, 0x00050000 | 1, 0x80000000
"""What the filter says: carry it out, answer "not permitted" (EPERM, 1), end the process."""


def call_filter() -> bytes | None:
    """Return the filter's program for this processor, or None where its numbers are not known."""
    machine = platform.machine()
    if machine not in REFUSED:
        return None
    numbers = sorted(REFUSED[machine].values())
    steps = [
        (LOAD, 0, 0, ARCHITECTURE),
        (JUMP_EQUAL, 1, 0, ARCHITECTURES[machine]),
        (RETURN, 0, 0, KILL),
        (LOAD, 0, 0, NUMBER),
        (JUMP_AT_LEAST, len(numbers) + 1, 0, OTHER_NUMBERS),
        *((JUMP_EQUAL, len(numbers) - index, 0, number) for index, number in enumerate(numbers)),
        (RETURN, 0, 0, ALLOW),
        (RETURN, 0, 0, REFUSE),
    ]
    return b"".join(struct.pack("=HBBI", *step) for step in steps)
