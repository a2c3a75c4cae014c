"""Files and folders written beside their target and moved into place."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A place to write a file, which then moves to its path: it is there in full or not at all.

    Parameters
    ----------
    path : path

    Yields
    ------
    Path
        Of the same name, in an empty folder beside.
    """
    target = Path(path)
    with tempfile.TemporaryDirectory(prefix=".fringetrace-", dir=target.parent) as folder:
        part = Path(folder, target.name)
        yield part
        os.replace(part, target)


@contextlib.contextmanager
def staged(folder: Path) -> Iterator[Path]:
    """A place to write in; all files move on to `folder` at the end, none of them if something fails.

    Parameters
    ----------
    folder : Path
        Made if it does not exist, and taken away again if something fails.

    Yields
    ------
    Path
        An empty folder inside of `folder`.

    Raises
    ------
    OSError
        If nothing can be written there.
    """
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".fringetrace-", dir=folder) as part:
            yield Path(part)
            for file in sorted(Path(part).iterdir()):
                os.replace(file, folder / file.name)
    except BaseException:
        for path in made:
            with contextlib.suppress(OSError):
                path.rmdir()
        raise
