"""Changes a checkpoint as if rfem had written it so: the line with the checksum at its end is made anew."""

import lzma

import h5py

WORDS = b"rfem checkpoint ends here, checksum "
LENGTH = len(WORDS) + 17
FOOTER, CHECK = 12, 8


def checksum(content):
    """As rf_checksum, 16 hexadecimal digits: the CRC-64 that .xz files have between block and index."""
    if not content:
        return b"0" * 16
    packed = lzma.compress(content, check=lzma.CHECK_CRC64, preset=0)
    index = 4 * (1 + int.from_bytes(packed[-FOOTER + 4 : -FOOTER + 8], "little"))
    end = len(packed) - FOOTER - index
    return b"%016X" % int.from_bytes(packed[end - CHECK : end], "little")


def sealed(body):
    """With the line that ends a checkpoint."""
    return body + WORDS + checksum(body) + b"\n"


def edit(path, change):
    """Call `change` with the checkpoint's h5py file, open for writing."""
    content = path.read_bytes()
    assert sealed(content[:-LENGTH]) == content
    path.write_bytes(content[:-LENGTH])
    with h5py.File(path, "r+") as file:
        change(file)
    path.write_bytes(sealed(path.read_bytes()))
