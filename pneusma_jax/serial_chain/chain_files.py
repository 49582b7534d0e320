"""Which files describe a chain; see `designs` for what they hold."""

from importlib import resources
from pathlib import Path

from ..documents import parse_toml, shipped_names

SCHEMA = "pneusma-chain/1"
EXAMPLES = resources.files("calibration_data").joinpath("examples", "chains")


def chain_examples() -> list[str]:
    """Names of the chains that come with the package, sorted."""
    return shipped_names(EXAMPLES)


def describes_chain(name_or_path: str | Path) -> bool:
    """True if a design is a chain, by name or by the schema of its file; false where none can be read."""
    if str(name_or_path) in chain_examples():
        return True
    if not str(name_or_path).endswith(".toml"):
        return False
    try:
        text = Path(name_or_path).read_text(encoding="utf-8")
        return parse_toml(text, Path(name_or_path)).get("schema") == SCHEMA
    except (OSError, ValueError):
        return False  # the reader of tables reports the error
