"""Zygo height-map files, MetroPro `.dat` and Mx `.datx`: reading and writing.

Height maps are arrays [row, column] with origin lower, in metres, NaN where there is no height. The files
begin with the top row of the picture.
"""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import Any

import numpy as np

from fringetrace.core import FloatArray, checked_length, checked_wavelength, filled, nm, whole

METROPRO, MX = KINDS = (".dat", ".datx")
# First four bytes of the three versions of MetroPro's format, and of HDF5, which is Mx's.
METROPRO_MAGIC = (b"\x88\x1b\x03\x6f", b"\x88\x1b\x03\x70", b"\x88\x1b\x03\x71")
MX_MAGIC = b"\x89HDF"
# Bytes of the first version's header; counts a fringe at high resolution; from here on a count is no height.
HEADER, COUNTS, INVALID = 834, 32768, 2147483640
# Waves of height a fringe, for light that is reflected.
FRINGE = 0.5
# No height, in Mx's files.
NO_DATA = float(np.finfo(np.float64).max)
SURFACE = "/Data/Surface/{00000000-0000-0000-0000-000000000001}"


def existing_file(path: str | os.PathLike[str]) -> Path:
    """Checked path of an existing file.

    Raises
    ------
    FileNotFoundError
        If there is none.
    """
    if not Path(path).is_file():
        raise FileNotFoundError(f"{path}: expected an existing file, got none there")
    return Path(path)


def read_height_map(path: str | os.PathLike[str]) -> tuple[FloatArray, float]:
    """Read measured heights from a Zygo MetroPro `.dat` or Mx `.datx` file.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    z : (rows, columns) float64, metres
        NaN where the instrument found no height. The file begins with the top row of the picture;
        here row 0 is the bottom one.
    pitch : float, metres
        Distance of neighbouring pixels.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If it is neither of these, is cut short, or was written without a lateral calibration.
    """
    file = existing_file(path)
    suffix = file.suffix.lower()
    if suffix not in KINDS:
        raise ValueError(f"{path}: expected a height map named {METROPRO} or {MX}, got {suffix!r}")
    kind, magics, read = (
        ("MetroPro", METROPRO_MAGIC, _metropro) if suffix == METROPRO else ("Mx", (MX_MAGIC,), _mx)
    )
    with file.open("rb") as stream:
        magic = stream.read(4)
    if magic not in magics:
        raise ValueError(f"{path}: expected a {kind} file, got one that begins with {magic!r}")
    try:
        z, pitch = read(file)
    except Exception as error:  # a header cut short raises struct.error, odd ones KeyError, HDF5 OSError
        raise ValueError(
            f"{path}: expected a whole {kind} file, got one that does not parse: {error}"
        ) from error
    if not pitch > 0.0:
        raise ValueError(f"{path}: expected a calibrated map, got a lateral resolution of {pitch:g} m")
    return np.asarray(z[::-1], dtype=np.float64), pitch


def _metropro(file: Path) -> tuple[FloatArray, float]:
    """Heights, the top row first, and pitch."""
    from prysm.io import read_zygo_dat

    content = read_zygo_dat(file)
    meta = content["meta"]
    upwards = -1.0 if meta["sign"] else 1.0  # prysm leaves the header's sign to its caller
    return content["phase"] * (upwards * nm), float(meta["lateral_resolution"])


def _mx(file: Path) -> tuple[FloatArray, float]:
    """Heights, the top row first, and pitch."""
    import h5py
    from prysm.io import read_zygo_datx

    content = read_zygo_datx(file)
    with h5py.File(file) as stored:
        (surface,) = stored["Data/Surface"].values()
        across, along = (float(surface.attrs[f"{axis} Converter"][0][-1][1]) for axis in "XY")
    if across != along:
        raise ValueError(f"pixels of {across:g} m x {along:g} m, which are no squares")
    return content["phase"] * nm, across


def write_height_map(
    z: FloatArray, pitch: float, path: str | os.PathLike[str], *, wavelength: float = 632.8 * nm
) -> None:
    """Write heights as a Zygo MetroPro `.dat` or Mx `.datx` file, atomically.

    A `.dat` file counts heights in wavelength / 65536 (10 pm) and keeps the pitch to 7 digits; a `.datx`
    file keeps all digits of heights in nm.

    Parameters
    ----------
    z : (rows, columns) float64, metres
        Row 0 is the bottom one; what is not finite, or masked as in numpy.ma, becomes "no data".
    pitch : float, metres
    path : path-like
        Its suffix says the kind.
    wavelength : float, metres
        Of the instrument, named in the file.

    Raises
    ------
    ValueError
        If the kind is another one, the array has not two axes, or heights are too large to be counted.
    """
    heights = filled(z)
    if heights.ndim != 2 or heights.size == 0:
        raise ValueError(f"height map: expected shape (rows, columns), got {heights.shape}")
    suffix = Path(path).suffix.lower()
    if suffix not in KINDS:
        raise ValueError(f"{path}: expected a file named {METROPRO} or {MX}, got {suffix or 'no suffix'!r}")
    pitch, wavelength = checked_length(pitch, "pitch"), checked_wavelength(wavelength)
    write = _write_metropro if suffix == METROPRO else _write_mx
    with whole(path) as part:
        write(part, heights[::-1], pitch, wavelength)


def _write_metropro(file: Path, z: FloatArray, pitch: float, wavelength: float) -> None:
    """The first version of the format, without intensities; big-endian, as in Zygo's reference guide."""
    rows, columns = z.shape
    if max(rows, columns) > 65535:
        raise ValueError(f"height map: expected at most 65535 rows and columns, got {rows} x {columns}")
    counts = z * (COUNTS / (FRINGE * float(np.float32(wavelength))))  # as the header rounds it
    seen = np.isfinite(counts)
    if not (np.abs(counts[seen]) < INVALID).all():
        most = float(np.abs(z[seen]).max())
        raise ValueError(
            f"height map: expected at most what {INVALID} counts say, got {most:g} m; write a {MX} file"
        )
    header = bytearray(HEADER)
    fields: tuple[tuple[int, str, tuple[Any, ...]], ...] = (
        (0, ">4sHI", (METROPRO_MAGIC[0], 1, HEADER)),
        (64, ">4HI", (0, 0, columns, rows, 4 * z.size)),
        (80, ">82s", (b"fringetrace",)),
        (162, ">H", (1,)),  # generated, not measured
        # waves a fringe, wavelength, numerical aperture, obliquity, magnification, pitch
        (164, ">6f", (FRINGE, wavelength, 0.0, 1.0, 0.0, pitch)),
        (218, ">H", (1,)),  # high resolution
        (234, ">2H", (columns, rows)),
    )
    for place, layout, values in fields:
        struct.pack_into(layout, header, place, *values)
    data = np.where(seen, np.rint(np.where(seen, counts, 0.0)), INVALID).astype(">i4")
    file.write_bytes(bytes(header) + data.tobytes())


def _write_mx(file: Path, z: FloatArray, pitch: float, wavelength: float) -> None:
    """HDF5 with the names that readers of Mx's files look for."""
    import h5py

    text = h5py.string_dtype()
    converter = np.dtype([("Category", text), ("BaseUnit", text), ("Parameters", "<f8", 4)])
    links = np.dtype([("Source", text), ("Link", text), ("Destination", text)])
    chain = [("Root", "Measurement", "{1}"), ("{1}", "Surface", "{2}"), ("{2}", "Path", SURFACE)]
    with h5py.File(file, "w") as stored:
        surface = stored.create_dataset(SURFACE, data=np.where(np.isfinite(z), z / nm, NO_DATA))
        attributes = {
            "Unit": np.array(["NanoMeters"], text), "No Data": [NO_DATA], "Wavelength": [wavelength],
            "Interferometric Scale Factor": [FRINGE], "Obliquity Factor": [1.0],
            "Z Converter": np.array([("HeightCat", "NanoMeters", (0.0, wavelength, FRINGE, 1.0))], converter),
        }  # fmt: skip
        for axis in "XY":
            values = ("LateralCat", "Pixels", (0.0, pitch, 0.0, 0.0))
            attributes[f"{axis} Converter"] = np.array([values], converter)
        for name, value in attributes.items():
            surface.attrs[name] = value
        about = stored.create_group("Attributes/{3}")
        for name, value in (("Wavelength", wavelength), ("Lateral Resolution", pitch)):
            about.attrs[f"Data Context.{name}:Value"] = [value]
        about.attrs["Data Context.Comment"] = np.array(["fringetrace"], text)
        stored.create_dataset("MetaData", data=np.array(chain, links))
