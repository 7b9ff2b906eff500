"""Changes a checkpoint as if rfem had written it so: the line with the checksum at its end is made anew."""

import h5py
import numpy as np

PRIME = 4294967291
WORDS = b"rfem checkpoint ends here, checksum "
LENGTH = len(WORDS) + 17


def checksum(content):
    """As rf_checksum: 16 hexadecimal digits."""
    first, second = 1, 0
    for start in range(0, len(content), 65536):
        block = np.frombuffer(content[start : start + 65536], np.uint8).astype(np.int64)
        n = len(block)
        second = (second + n * first + int((block * np.arange(n, 0, -1)).sum())) % PRIME
        first = (first + int(block.sum())) % PRIME
    return b"%08X%08X" % (second, first)


def edit(path, change):
    """Call `change` with the checkpoint's h5py file, open for writing."""
    content = path.read_bytes()
    assert content[-LENGTH:] == WORDS + checksum(content[:-LENGTH]) + b"\n"
    path.write_bytes(content[:-LENGTH])
    with h5py.File(path, "r+") as file:
        change(file)
    content = path.read_bytes()
    path.write_bytes(content + WORDS + checksum(content) + b"\n")
