"""The documentation's site: every page has its place, and every link leads somewhere."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml

from tests.test_repository import anchors

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"


def loaded(name: str) -> ModuleType:
    """Load a script of the documentation."""
    specification = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def pages_of(entries: Any) -> list[str]:
    """Return the pages of a menu, from the top."""
    if isinstance(entries, str):
        return [entries]
    inside = entries.values() if isinstance(entries, dict) else entries
    return [page for entry in inside for page in pages_of(entry)]


def site() -> dict[str, tuple[Path, str]]:
    """Return each page of the site, with its file and its text as the site has it."""
    hooks = loaded("site_hooks")
    texts = {path.relative_to(DOCS).as_posix(): path for path in DOCS.rglob("*.md")}
    pages = {
        name: (path, hooks.LINK.sub(hooks.from_docs, path.read_text(encoding="utf-8")))
        for name, path in texts.items()
    }
    for name, page in hooks.PAGES.items():
        text = (ROOT / name).read_text(encoding="utf-8")
        once = hooks.LINK.sub(hooks.from_root, text)
        pages[page] = (ROOT / name, hooks.LINK.sub(hooks.from_docs, once))
    return pages


def test_the_menu_has_every_page_once() -> None:
    """Those of docs/ and the texts beside it."""
    menu = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
    assert sorted(pages_of(menu)) == sorted(site())


def test_every_link_of_the_site_leads_to_a_page_and_its_heading() -> None:
    """After links to texts outside docs/ were led to their pages, or became words."""
    pages = site()
    wrong = []
    for page, (_, text) in pages.items():
        for target in re.findall(r"(?<!`)\[[^\]]*\]\(([^)\s]+)\)", text):
            if "://" in target:
                continue
            file, _, section = target.partition("#")
            name = (Path("/") / page).parent / file if file else Path("/") / page
            place = Path(name.as_posix().replace("/lab/../", "/")).relative_to("/").as_posix()
            if place in pages:
                found = not section or section in anchors(pages[place][0])
            else:
                found = (DOCS / place).is_file()
            wrong += [] if found else [f"{page}: {target}"]
    assert wrong == []


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the site, built by one command without a warning."""
    if importlib.util.find_spec("mkdocs") is None:
        pytest.skip("needs the extra docs")
    folder = tmp_path_factory.mktemp("built") / "site"
    words = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(folder)]
    subprocess.run(words, cwd=ROOT, check=True)
    return folder


@pytest.mark.slow
def test_the_site_describes_every_public_name(built: Path) -> None:
    """A name's arguments stand on the page of names."""
    text = (built / "api.html").read_text(encoding="utf-8")
    import tendon_newton

    for name, module in tendon_newton.EXPORTS.items():
        assert f'id="{module}.{name}"' in text
    assert (built / "overview.html").is_file()


@pytest.mark.slow
def test_the_site_needs_no_network(built: Path) -> None:
    """Nothing of a page comes from elsewhere."""
    elsewhere = re.compile(r'<(?:script|link|img)[^>]*(?:src|href)="https?://')
    assert not any(
        elsewhere.search(page.read_text(encoding="utf-8")) for page in built.glob("*.html")
    )
