"""docs/security.md gives the limits as they are."""

import re
from pathlib import Path

from clench.core.files import file_limits

PAGE = (Path(__file__).parents[2] / "docs" / "security.md").read_text(encoding="utf-8")


def test_every_limit_is_on_the_page_with_its_value():
    rows = re.findall(r"^\| `(\w+)` \| (\S+)( MB)? \|", PAGE, re.MULTILINE)
    written = {name: float(value) * (2**20 if unit else 1) for name, value, unit in rows}
    assert written == {
        name: float(value) for name, value in vars(file_limits).items() if re.match("[A-Z]", name) and name != "Final"
    }
