"""Names models so that models with different options have different folders."""

import hashlib

from .scene import Scene


def suffix(scene: Scene, own: Scene, functions: str | None = None) -> str:
    """Return what options add to the name of a scene.

    functions: as the user gave them; "all" is added as a word, other choices as a short hash.
    """
    keys = ("real", "emission", "profile")
    words = [getattr(scene, key) for key in keys if getattr(scene, key) != getattr(own, key)]
    if scene.baked != own.baked:
        words.append("baked")
    if scene.functions != own.functions:
        digest = hashlib.sha256(",".join(scene.functions).encode()).hexdigest()
        words.append("all" if functions == "all" else f"f{digest[:6]}")
    return "".join(f"_{word}" for word in words)
