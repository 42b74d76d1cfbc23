"""Pictures become a moving film: GIF by Pillow, MP4 by ffmpeg."""

import importlib.util
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from contextlib import suppress
from io import BytesIO
from itertools import chain
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...basics.errors import ViewError
from ...basics.files import replacing
from .style import FORCE, HEAD, INK, LEG, QUIET, SHADE, SHADOW, TAIL, TORSO

Picture = NDArray[np.uint8]  # (height, width, 3), both even
RATE = 25  # frames a second


def encoder() -> str:
    """Return the path of ffmpeg: that of imageio-ffmpeg, else one on PATH; ViewError if none."""
    if importlib.util.find_spec("imageio_ffmpeg") is not None:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    program = shutil.which("ffmpeg")
    if program is None:
        remedy = 'pip install "serpentail[film]", or write a .gif'
        raise ViewError(f"an .mp4 needs ffmpeg, which is not on PATH: {remedy}")
    return program


def write_gif(path: Path, pictures: Iterator[Picture]) -> None:
    """Write a GIF that repeats for ever, whole or not at all."""
    from PIL import Image

    whole, colours = BytesIO(), Image.new("P", (1, 1))
    colours.putpalette(palette())
    plain = {"palette": colours, "dither": Image.Dither.NONE}
    images = (Image.fromarray(picture).quantize(**plain) for picture in pictures)
    look = {"duration": 1000 // RATE, "loop": 0, "optimize": False}
    next(images).save(whole, format="GIF", save_all=True, append_images=images, **look)
    with replacing(path) as part:
        part.write_bytes(whole.getvalue())


def palette() -> list[int]:
    """Return red, green, blue of all colours and their edges, the same in all frames."""
    from matplotlib.colors import to_rgb

    ink = np.array([to_rgb(colour) for colour in (INK, QUIET, TAIL, HEAD, LEG, FORCE, SHADOW)])
    ground = np.array([to_rgb(colour) for colour in ("white", SHADE, TORSO)])
    share = np.linspace(0, 1, 9)[:, None, None, None]
    mixed = (share * ink[:, None] + (1 - share) * ground).reshape(-1, 3)
    return np.unique(np.round(255 * mixed).astype(int), axis=0).ravel().tolist()


def write_mp4(path: Path, pictures: Iterator[Picture]) -> None:
    """Write an H.264 film that every browser plays, whole or not at all."""
    first = next(pictures)
    size = f"{first.shape[1]}x{first.shape[0]}"
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", str(RATE), "-i", "-"]
    plain = ["-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact"]
    coded = ["-c:v", "libx264", "-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    with replacing(path) as part:
        command = [encoder(), "-v", "error", "-y", *raw, *coded, *plain, "-f", "mp4", str(part)]
        _feed(command, chain([first], pictures))


def _feed(command: list[str], pictures: Iterable[Picture]) -> None:
    """Run ffmpeg on pictures; OSError with its last message if it fails."""
    with TemporaryFile() as told:
        ways: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": told}
        with subprocess.Popen(command, stdin=subprocess.PIPE, **ways) as process:
            assert process.stdin is not None
            with suppress(BrokenPipeError), process.stdin as raw:  # it ended, and says why
                for picture in pictures:
                    raw.write(picture.tobytes())
        if process.returncode:
            told.seek(0)
            lines = told.read().decode(errors="replace").strip().split("\n")
            raise OSError(f"ffmpeg: {lines[-1] or process.returncode}")
