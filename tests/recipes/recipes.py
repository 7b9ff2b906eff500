"""The recipes of docs/developer.md: taken out of the page, applied to a copy of the project.

A fenced block whose first line says `file=PATH` is a recipe. ```diff blocks change a file: lines with `+` are new,
lines with `-` go, others show where; `@@` separates places. What a place shows (all but the lines with `+`) must stand
in the file once, line after line. Any other block is a new file.
"""

import re

FENCE = re.compile(r"^```(\w+) file=(\S+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# what the copy is built from
PARTS = ("CMakeLists.txt", "CMakePresets.json", "cmake", "src", "tests", "postproc")


def blocks(page):
    """(language, path, text) of every recipe of a page, in its order."""
    return FENCE.findall(page)


def patched(text, diff, path):
    """A file's text with the changes of a ```diff block."""
    for number, place in enumerate(re.split(r"^@@.*\n", diff, flags=re.MULTILINE), 1):
        lines = [line or " " for line in place.splitlines()]
        old = "".join(line[1:] + "\n" for line in lines if line[0] != "+")
        new = "".join(line[1:] + "\n" for line in lines if line[0] != "-")
        found = ("\n" + text).count("\n" + old)
        if not old or found != 1:
            raise ValueError(f"docs/developer.md, place {number} in {path}: there {found} times, not once:\n{old}")
        at = ("\n" + text).index("\n" + old)
        text = text[:at] + new + text[at + len(old) :]
    return text


def project_files(source):
    """The bytes of all files that the copy is built from, by path relative to the project."""
    files = {}
    for part in PARTS:
        root = source / part
        for path in [root] if root.is_file() else sorted(root.rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                files[path.relative_to(source).as_posix()] = path.read_bytes()
    return files


def apply(files, page):
    """Apply every recipe of a page to the files."""
    for language, path, text in blocks(page):
        if language == "diff":
            files[path] = patched(files[path].decode(), text, path).encode()
        elif path in files:
            raise ValueError(f"docs/developer.md: the new file {path} is in the project already")
        else:
            files[path] = text.encode()


def write(files, folder):
    """Make a folder hold these files and no others. What is right already is not touched, so that little is rebuilt."""
    for part in PARTS:
        root = folder / part
        for path in root.rglob("*") if root.is_dir() else []:
            if path.is_file() and path.relative_to(folder).as_posix() not in files:
                path.unlink()
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_bytes() != content:
            path.write_bytes(content)
