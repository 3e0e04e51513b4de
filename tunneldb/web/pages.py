"""Pages of the desk."""

from __future__ import annotations

from pathlib import Path

from starlette.templating import Jinja2Templates

FOLDER = Path(__file__).parent
TEMPLATES = Jinja2Templates(FOLDER / "templates")
"""Templates; Jinja2 escapes what is put into them."""
