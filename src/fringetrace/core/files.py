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
    """Temporary path for a file that is moved to its target once complete.

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
    """Temporary folder whose files are moved to `folder` together, or not at all after an error.

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
