# SPDX-License-Identifier: BSD-3-Clause
"""The documentation site, of the same Markdown files as GitHub shows: docs/build.sh makes it.

The sources' folder is the top of the repository, so that relative links mean the same in both.
"""

import ast
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from docutils import nodes
from pygments.lexers import find_lexer_class_for_filename
from sphinx import addnodes
from sphinx.util import logging

ROOT = Path(__file__).resolve().parents[1]
XML = ROOT / "build" / "docs" / "xml"

# The map at the left, and all pages but README.md, which is the first.
NAVIGATION = {
    "Getting started": ["start", "installing", "limits"],
    "Tutorials": [
        f"tutorials/{name}"
        for name in (
            "swap shadow own_manager hair_step live_pairs gust hair_head harness obstacles yarn "
            "neuron python"
        ).split()
    ],
    "Guide": ["options", "files", "contacts", "program", "python", "gallery", "faq"],
    "API": [
        f"api/{name}"
        for name in "tree meshes managers options contacts files benchmark python".split()
    ],
    "Reference": ("contract crossings numerics scoreboard glossary".split()),
    "Paper": ["paper", "paper_measured"],
    "Performance": ["performance", "trade", "measured"],
    "Developers": ["architecture", "/CONTRIBUTING", "log", "/CHANGELOG"],
}

project = "fcl_fibers"
version = release = re.search(r"VERSION (\d[\d.]+)\n", (ROOT / "CMakeLists.txt").read_text())[1]
extensions = ["myst_parser", "breathe", "sphinx_copybutton"]
root_doc = "README"
include_patterns = ["*.md", "docs/**.md"]
# No part of any page, and large.
exclude_patterns = ["build*", "tests", "benchmarks", ".git"]
myst_heading_anchors = 6
myst_enable_extensions = ["html_image"]
breathe_projects = {project: str(XML)}
breathe_default_project = project
# Names that other libraries document, the namespaces, and a name that a class takes from its base.
# Sphinx does not find what is in a template with its argument.
NOT_FOUND = r"(std|fcl)(::.*)?|fcl_fibers(::(io|benchmarks))?|Object|FiberArrays<double>::.*"
nitpick_ignore_regex = [("cpp:.*", NOT_FOUND)]

html_theme = "furo"
html_title = f"{project} {version}"
html_static_path = ["site.css", "../build/docs/live"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False

# A line of a page in docs/api/ that is a link to a header, and no more.
HEADER = re.compile(r"^\[[^\]]*\]\(\.\./\.\./include/(.*\.h)\)$", re.MULTILINE)
API_PAGES = {
    header: f"docs/api/{page.stem}"
    for page in (ROOT / "docs/api").glob("*.md")
    for header in HEADER.findall(page.read_text())
}
LISTED = set()
# Pages of docs/pictures/live.sh, and what they show first.
LIVE = {"ponytail": "camera=75,8,1.4", "parting": "markers=0&camera=40,14,1"}
LOGGER = logging.getLogger(__name__)


def add_navigation(app, docname, source):
    """README.md itself is to stay Markdown that any reader shows."""
    if docname == root_doc:
        for caption, pages in NAVIGATION.items():
            names = "\n".join(page if page.startswith("/") else f"/docs/{page}" for page in pages)
            source[0] += f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{names}\n```\n"


def compound(refid):
    return ElementTree.parse(XML / f"{refid}.xml").find("compounddef")


def dissolve_groups():
    """Overloads between ///@{ and ///@} are no section of their own, but functions among others."""
    for path in XML.glob("class*.xml"):
        tree = ElementTree.parse(path)
        for group in tree.findall(".//sectiondef[@kind='user-defined']"):
            functions = tree.find(".//sectiondef[@kind='public-func']")
            functions.extend(group.findall("memberdef"))
            functions[:] = sorted(functions, key=lambda f: int(f.find("location").get("line")))
            tree.find("compounddef").remove(group)
        tree.write(path)


def declarations():
    """Header, line, kind and name of all that is public, outside classes, by Doxygen's XML."""

    def entry(element, name):
        place = element.find("location")
        return place.get("file"), int(place.get("line")), element.get("kind"), name

    for space in ElementTree.parse(XML / "index.xml").findall("compound[@kind='namespace']"):
        space = compound(space.get("refid"))
        name = space.findtext("compoundname")
        for found in space.iter("memberdef"):
            arguments = found.findtext("argsstring") if found.get("kind") == "function" else ""
            yield entry(found, f"{name}::{found.findtext('name')}{arguments}")
        for inner in space.findall("innerclass"):
            yield entry(compound(inner.get("refid")), inner.text)


def add_declarations(app, docname, source):
    """A page in docs/api/ has what a header declares below the link to it."""

    def directives(match):
        lines = [match[0], f"```{{doxygenfile}} {match[1]}\n:sections: detaileddescription\n```"]
        for _, kind, name in sorted(d[1:] for d in declarations() if d[0] == match[1]):
            heading = "### " + name.partition("(")[0].rpartition("::")[2]
            if heading not in lines:
                lines.append(heading)
            members = ":members:\n" if kind in ("class", "struct") else ""
            lines.append(f"```{{doxygen{kind}}} {name}\n{members}```")
        return "\n\n".join(lines)

    if docname.startswith("docs/api/"):
        source[0] = HEADER.sub(directives, source[0])


def python_declarations(module, depth=3, of=""):
    """Headings, signatures and docstrings of what the package has of a module, or of a class."""
    package = ast.parse((ROOT / "python/fcl_fibers/__init__.py").read_text()).body[-1]
    exported = ast.literal_eval(package.value)  # __all__
    for node in module.body:
        if not isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            continue
        if node.name.startswith("_") and node.name != "__init__":
            continue
        if isinstance(module, ast.Module) and node.name not in exported:
            continue
        documentation = ast.get_docstring(node)
        decorators = [ast.unparse(decorator) for decorator in node.decorator_list]
        if any(decorator.endswith(".setter") for decorator in decorators):
            continue
        if documentation is None and node.name != "__init__" and not decorators:
            LOGGER.warning(f"{node.name} of Python has no docstring")
        if node.name != "__init__":
            yield f"{'#' * depth} {node.name}"
        if isinstance(node, ast.FunctionDef):
            arguments = ast.unparse(node.args).replace("self, ", "").replace("self", "")
            returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
            call = "" if "property" in decorators else f"({arguments})"
            name = of if node.name == "__init__" else node.name
            yield f"```python\n{name}{call}{returns}\n```"
        if documentation:
            yield f"```text\n{documentation}\n```"
        if isinstance(node, ast.ClassDef):
            yield from python_declarations(node, depth + 1, node.name)


def add_python(app, docname, source):
    """docs/api/python.md has the docstrings below links to the sources, as they stand there."""

    def directives(match):
        module = ast.parse((ROOT / "python" / match[1]).read_text())
        return "\n\n".join([match[0], *python_declarations(module)])

    if docname == "docs/api/python":
        link = r"^\[[^\]]*\]\(\.\./\.\./python/(.*\.py)\)$"
        source[0] = re.sub(link, directives, source[0], flags=re.MULTILINE)


def add_live_pages(app, doctree, docname):
    """Pictures of the gallery are pages of `fcl_fibers view` where docs/pictures/live.sh has made
    them."""
    for image in list(doctree.findall(nodes.image)) if docname == "docs/gallery" else []:
        name = Path(image["uri"]).stem
        if name not in LIVE:
            continue
        page = f"../_static/{name}.html"
        html = (
            f'<iframe src="{page}#{LIVE[name]}" title="{image["alt"]}" loading="lazy" '
            'style="width: 100%; height: 30rem; border: 0"></iframe>'
            f'<br><a href="{page}">The page alone</a>'
        )
        image.parent.replace(image, nodes.raw("", html, format="html"))


def mark_wide_tables(app, doctree):
    """Those that site.css has to break to show their last column."""
    for table in doctree.findall(nodes.table):
        columns = zip(*(row.children for row in table.findall(nodes.row)))
        if sum(3 + max(len(cell.astext()) for cell in column) for column in columns) > 125:
            table["classes"].append("wide")


def prepare_links(app, doctree):
    """Links to files that are no pages are for the resolver below, not for downloads."""
    for node in doctree.findall(nodes.raw):
        if re.search(r"(href|src)=\"(?!https?:)", node.astext()):
            LOGGER.warning("Write this link or image as Markdown, not as HTML", location=node)
    for node in list(doctree.findall(addnodes.download_reference)):
        node.replace_self(addnodes.pending_xref("", *node.children, **node.attributes))


def resolve_source(app, env, node, content):
    """A link to a header leads to its page in docs/api/, one to another file to its listing."""
    if node["reftype"] != "any":
        return None
    path = (ROOT / node["refdoc"]).parent.joinpath(node["reftarget"]).resolve()
    if not path.exists() or not path.is_relative_to(ROOT):
        return None
    page = str(path.relative_to(ROOT))
    header = page.partition("include/")[2]
    if header in API_PAGES and API_PAGES[header] != node["refdoc"]:
        page = API_PAGES[header]
    else:
        LISTED.add(path)
    uri = app.builder.get_relative_uri(node["refdoc"], page)
    return nodes.reference("", "", content, internal=True, refuri=uri)


def listings(app):
    """Pages of the files and folders that links lead to."""
    waiting = set(LISTED)
    while waiting:
        path = waiting.pop()
        page = str(path.relative_to(ROOT))
        if path.is_dir():
            files = sorted(file for file in path.iterdir() if file.is_file())
            waiting.update(files)
            uris = [(app.builder.get_relative_uri(page, f"{page}/{f.name}"), f.name) for f in files]
            body = "".join(f'<li><a href="{uri}">{name}</a></li>' for uri, name in uris)
            body = f"<ul>{body}</ul>"
        else:
            lexer = find_lexer_class_for_filename(path.name)
            language = lexer.aliases[0] if lexer else "text"
            body = app.builder.highlighter.highlight_block(
                path.read_text(errors="replace"), language
            )
        context = {"title": page, "body": f"<h1>{page}</h1>{body}"}
        yield page, context, "page.html"


def setup(app):
    dissolve_groups()
    headers = {str(h.relative_to(ROOT / "include")) for h in ROOT.glob("include/**/*.h")}
    for header in headers - set(API_PAGES):
        LOGGER.warning(f"{header} is on no page of docs/api/")
    app.connect("source-read", add_navigation)
    app.connect("source-read", add_declarations)
    app.connect("source-read", add_python)
    app.connect("doctree-read", mark_wide_tables)
    # Before Sphinx collects downloads.
    app.connect("doctree-read", prepare_links, priority=400)
    app.connect("missing-reference", resolve_source)
    app.connect("html-collect-pages", listings)
    app.connect("doctree-resolved", add_live_pages)
