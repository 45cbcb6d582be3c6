"""Words that hide what a name or a doc is about: what is a participle, what is an old name."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

TABLE = tomllib.loads(Path(__file__).with_name("words.toml").read_text(encoding="utf-8"))
IRREGULAR = frozenset(TABLE["irregular"].split())
NOT_PARTICIPLES = frozenset(TABLE["not_participles"].split())
# First words of a doc comment that hide the noun a reader searches for.
OPENING = re.compile(r"(What|How|Whether|Where|Of|The same|As)\b")
CORE = "rust/core/src/"


def is_participle(name: str) -> bool:
    """Presence of nothing but a past participle in a name, its leading underscores aside."""
    word = name.lstrip("_")
    if word in NOT_PARTICIPLES or "_" in word:
        return False
    return word in IRREGULAR or (word.endswith("ed") and len(word) > 3)


def is_old_file(path: str) -> bool:
    """Presence of a file's name in the table."""
    if path.startswith(CORE):
        inner = path.removeprefix(CORE)
        return any(
            inner.startswith(old) if old.endswith("/") else inner in (f"{old}.rs", f"{old}/mod.rs")
            for old in TABLE["core_files"].split()
        )
    name = path.rpartition("/")[2].removesuffix(".py")
    is_python = path.startswith("python/tdcr/") and path.endswith(".py")
    return is_python and name in TABLE["python_files"].split()


def old_names(path: str, names: list[tuple[str, str, int]]) -> list[tuple[str, int]]:
    """Names in the table among those that a file of the core declares (kind, name, line)."""
    if not path.startswith(CORE):
        return []
    inner = path.removeprefix(CORE)
    found: dict[str, int] = {}
    for kind, name, line in names:
        is_type = kind in ("struct", "enum", "trait", "type")
        rooms = TABLE["types" if is_type else "names"]
        word = name if is_type else name.lower()
        if any(inner.startswith(room) and word in words.split() for room, words in rooms.items()):
            found.setdefault(name, line)
    return sorted(found.items(), key=lambda item: item[1])
