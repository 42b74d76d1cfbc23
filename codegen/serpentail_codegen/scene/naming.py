"""Names models by what distinguishes them, so that no option overwrites another's folder."""

import hashlib

from .scene import Scene


def suffix(scene: Scene, own: Scene, functions: str | None = None) -> str:
    """Return what the name of a scene with options has after that of the scene's own.

    functions: as given by the user; "all" is said so, other choices get a short hash.
    """
    keys = ("real", "emission", "profile")
    words = [getattr(scene, key) for key in keys if getattr(scene, key) != getattr(own, key)]
    if scene.baked != own.baked:
        words.append("baked")
    if scene.functions != own.functions:
        digest = hashlib.sha256(",".join(scene.functions).encode()).hexdigest()
        words.append("all" if functions == "all" else f"f{digest[:6]}")
    return "".join(f"_{word}" for word in words)
