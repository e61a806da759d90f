"""Selects the files of a folder that make up a scene, as `color3d colorize` does for photos."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Dict, Iterable, List

from color3d.connection import PathLike
from color3d.errors import InputError

_PICTURES = "jpg jpeg jpe jfif png tif tiff webp bmp heic heif hif".split()
_SPLATS = "ply sog spz".split()
_FILMS = "mp4 m4v mov 3gp mkv webm avi dv mpg mpeg vob ts mts m2ts mxf flv ogv wmv".split()
_MODEL_FILES = ("cameras", "images", "points3D")
_TRANSFORMS = ("transforms_train.json", "transforms_val.json", "transforms_test.json")


def _ending(path: PathLike) -> str:
    return Path(path).suffix[1:].lower()


def collect(root: Path) -> Dict[str, Path]:
    """Returns {path in the scene: file}: photos, then files with poses, each sorted.

    Takes the photos in images/, at any depth, if it has any, else those in `root` itself; COLMAP
    models in sparse/ (with times.txt); transforms.json with its points, or Blender's; else
    poses_bounds.npy. Or `root` is a splat or a film.
    Raises InputError if there is no such folder, or less than two photos.
    """
    if root.is_file() and _ending(root) in _SPLATS + _FILMS:
        return {root.name: root}
    if not root.is_dir():
        raise InputError(f"there is no folder {root}; give the folder of the photographs")
    photos = _pictures((root / "images").rglob("*"))
    photos = photos or _pictures(root.iterdir())
    if len(photos) < 2:
        raise InputError(
            f"{root} contains {len(photos) or 'no'} photograph{'s' if not photos else ''} (JPEG, "
            "PNG, TIFF, WebP, BMP or HEIC); at least 3 that overlap are needed"
        )
    files = photos + sorted(_model_files(root), key=str)
    return {file.relative_to(root).as_posix(): file for file in files}


def photo_names(paths: Iterable[str]) -> List[str]:
    """Returns the photos among the files of a scene, as names of views: relative to images/."""
    photos = [p for p in paths if _ending(p) in _PICTURES]
    photos = [p for p in photos if not p.startswith(("augment/", "masks/"))]
    return [p[len("images/") :] if p.startswith("images/") else p for p in photos]


def _pictures(paths: Iterable[Path]) -> List[Path]:
    found = [p for p in paths if _ending(p) in _PICTURES and p.is_file()]
    return sorted((p for p in found if not p.name.startswith(".")), key=str)


def _model_files(root: Path) -> List[Path]:
    names = [stem + ending for stem in _MODEL_FILES for ending in (".bin", ".txt")]
    files = [file for name in names for file in (root / "sparse").rglob(name)]
    if (root / "transforms.json").is_file():
        try:
            facts = json.loads((root / "transforms.json").read_text(encoding="utf-8"))
            names = ["transforms.json", str(facts.get("ply_file_path", "sparse_pc.ply"))]
        except (ValueError, AttributeError) as e:
            raise InputError(f"{root / 'transforms.json'} is not a JSON object: {e}") from None
    else:
        names = ["times.txt"] if files else ["poses_bounds.npy", *_TRANSFORMS]
    found = [root / name for name in names if (root / name).is_file()]
    return files + [file for file in found if root in file.parents]
