"""Files of a motion by their names: .npz, which is read again, .csv and .nc for other programs."""

from pathlib import Path

from ...basics.extras import needed
from ...motion.trajectory import Trajectory

WRITERS = {".npz": "save", ".csv": "to_csv", ".nc": "to_netcdf"}


def checked(path: str) -> Path:
    """Return the path of a file, with .npz if it has no suffix.

    ValueError if the suffix is unknown, OSError if it is a folder, ExtraMissing if the library for
    it is not installed.
    """
    target = Path(path)
    if target.is_dir():
        raise IsADirectoryError(f"{path} is a folder")
    if not target.suffix:
        return target.with_name(target.name + ".npz")
    if target.suffix not in WRITERS:
        raise ValueError(f"its name ends in {target.suffix}, which is none of {', '.join(WRITERS)}")
    if target.suffix == ".nc":
        needed("xarray", "xarray")
    return target


def save(motion: Trajectory, path: str) -> Path:
    """Write a motion to a file of the kind that its suffix names; return the path.

    Raises as ``checked``, and NotWritten if it cannot be written.
    """
    target = checked(path)
    written: Path = getattr(motion, WRITERS[target.suffix])(target)
    return written
