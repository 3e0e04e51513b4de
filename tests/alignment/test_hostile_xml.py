"""LandXML whose entities would fill the memory or read other files: expat, the parser, has limits of its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from tunneldb.alignment.landxml import LandXml
from tunneldb.errors import UserError

LAUGHS = "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 10))
BODY = '<LandXML><Units><Metric linearUnit="meter"/></Units><CgPoints><CgPoint name="1">{}</CgPoint></CgPoints></LandXML>'
FILES = {
    "billion laughs": (f'<!ENTITY l0 "lol">{LAUGHS}', "&l9;"),
    "quadratic blowup": (f'<!ENTITY a "{"a" * 50_000}">', "&a;" * 1000),
    "external entity": ('<!ENTITY a SYSTEM "{secret}">', "&a;"),
    "external parameter entity": ('<!ENTITY % a SYSTEM "{secret}"> %a;', "&b;"),
}


@pytest.mark.parametrize("attack", FILES)
def test_entities_are_neither_blown_up_nor_fetched(tmp_path: Path, attack: str) -> None:
    secret, path = tmp_path / "secret", tmp_path / "axis.xml"
    secret.write_text('<!ENTITY b "told">')
    entities, text = FILES[attack]
    entities = entities.replace("{secret}", secret.as_uri())
    path.write_text(f"<!DOCTYPE LandXML [{entities}]>{BODY.format(text)}")
    with pytest.raises(UserError, match="is not a complete XML file"):
        LandXml(path)
