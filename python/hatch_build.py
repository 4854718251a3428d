"""Puts the programs into the wheel that ``cargo xtask dist`` builds. Any other wheel is Python alone."""

from __future__ import annotations

import os
import platform
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Programs(BuildHookInterface):
    """Takes the folders ``bin``, ``lib`` and ``share`` below ``MIRROR_TREE``."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        tree = os.environ.get("MIRROR_TREE")
        if tree is None:
            return
        for path in Path(tree).rglob("*"):
            inside = path.relative_to(tree)
            if path.is_file():
                kind, to = ("shared_scripts", path.name) if inside.parts[0] == "bin" else ("shared_data", str(inside))
                build_data[kind][str(path)] = to
        # The programs run with this system's C library and later ones (PEP 600).
        libc, release = platform.libc_ver()
        if libc != "glibc":
            raise RuntimeError(f"the programs in the wheel are for Linux with glibc, and this is {libc or 'another system'}")
        major, minor = release.split(".")[:2]
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-manylinux_{major}_{minor}_{platform.machine()}"
