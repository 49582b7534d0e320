"""Every file that is shipped to be used or copied has a row in the documents."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = ROOT / "calibration_data"
PAGE = ROOT / "docs" / "files.md"


def shipped() -> set[str]:
    """Tables and examples, as the page names them; of a campaign its folder."""
    own = {path.relative_to(SHIPPED).as_posix() for path in SHIPPED.rglob("*.toml") if "examples" not in path.parts}
    examples = SHIPPED / "examples"
    campaigns = {path.parent.name for path in examples.rglob("campaign.toml")}
    files = {path for path in examples.rglob("*") if path.suffix in (".toml", ".json")}
    return own | campaigns | {
        path.relative_to(examples).as_posix() for path in files if path.parent.name not in campaigns
    }


def test_every_shipped_file_is_listed_and_every_listed_file_is_shipped():
    text = PAGE.read_text().split("## What is shipped")[1].split("\n## ")[0]
    cells = [line.split("|")[1] for line in text.splitlines() if line.startswith("| `")]
    listed = {name for cell in cells for name in re.findall(r"`([^`]+)`", cell)}
    assert len(listed) > 30 and listed == shipped()
