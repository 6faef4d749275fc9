"""What MkDocs calls while it builds the site (`hooks:` of mkdocs.yml)."""

from __future__ import annotations

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from tools.documentation.generated import GENERATED
from tools.documentation.mathematics import EquationError, with_mathml

ROOT = Path(__file__).resolve().parents[2]
RESULTS = "benchmarks/results"
"""Folder of the pictures that the pages of results show; they are copied beside the pages."""

_RESULT_PICTURE = re.compile(r"\]\((?:\.\./)+(benchmarks/results/[\w.]+\.(?:png|svg))\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pictures of the benchmarks and the pages that are written from the package."""
    for picture in sorted((ROOT / RESULTS).glob("*.png")):
        files.append(File.generated(config, f"{RESULTS}/{picture.name}", abs_src_path=str(picture)))
    for path, write in GENERATED.items():
        files.append(File.generated(config, path, content=write()))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Point pictures that a page takes from the benchmarks' folder to their copies in the site."""
    up = "../" * page.file.src_uri.count("/")
    return _RESULT_PICTURE.sub(rf"]({up}\1)", markdown)


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Draw the equations."""
    try:
        return with_mathml(html)
    except EquationError as error:
        raise PluginError(f"{page.file.src_uri}: {error}") from error
