# SPDX-License-Identifier: BSD-3-Clause
"""The documentation site, of the same Markdown files as GitHub shows: docs/build.sh makes it.

The sources' folder is the top of the repository, so that relative links mean the same in both.
"""

import ast
import csv
import io
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
            "neuron tract python"
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
nitpick_ignore_regex = [("cpp:.*", NOT_FOUND), ("py:.*", ".*")]

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


def paragraphs(documentation, arguments):
    """A docstring as reStructuredText. Lines `name   text` are parameters, or parts of a result."""
    text = re.sub(r"([*|\\]|_\b(?!\w))", r"\\\1", documentation)
    for block in re.sub(r"`([^`]+)`", r"``\1``", text).split("\n\n"):
        if block.startswith("    "):
            yield re.sub(r"\\(.)", r"\1", f"::\n\n{block}")
            continue
        entries = re.findall(r"^([\w, ]*\w) {2,}(.+(?:\n .*)*)", block, re.MULTILINE)
        if not entries:
            yield block
            continue
        is_input = set(entries[0][0].split(", ")) <= set(arguments)
        for names, what in entries:
            what = re.sub(r"\s*\n\s*", " ", what)
            if is_input:
                yield from (f":param {name}: {what}" for name in names.split(", "))
            else:
                yield f"``{names}``\n    {what}"


def python_declaration(node, of=None):
    """A class, with what is in it, or a function, as reStructuredText."""
    decorators = [ast.unparse(decorator) for decorator in node.decorator_list]
    if node.name.startswith("_") or any(name.endswith(".setter") for name in decorators):
        return ""
    documentation = ast.get_docstring(node) or ""
    if not documentation and not decorators:
        LOGGER.warning(f"{node.name} of Python has no docstring")
    called, members = node, []
    if isinstance(node, ast.ClassDef):
        kind, members = "class", [m for m in node.body if isinstance(m, ast.FunctionDef)]
        called = next((m for m in members if m.name in ("__init__", "__new__")), None)
    else:
        kind = ("property" if "property" in decorators else "method") if of else "function"
    if called:
        arguments = [*called.args.args, *called.args.kwonlyargs]
        for argument in arguments:
            argument.annotation = None  # the list of parameters tells shapes and types
        names = [argument.arg for argument in arguments]
        call = re.sub(r"^(self|cls)(, )?", "", ast.unparse(called.args))
    else:
        names = [m.target.id for m in node.body if isinstance(m, ast.AnnAssign)]
        call = ", ".join(names)
    lines = [f".. py:{kind}:: {node.name}" + ("" if kind == "property" else f"({call})")]
    if kind != "class" and node.returns and ast.unparse(node.returns) != "None":
        returns = ast.unparse(node.returns)
        lines[0] += f"\n   :type: {returns}" if kind == "property" else f" -> {returns}"
    if kind == "class" and not called:
        names = []  # parts of a result
    lines.extend(paragraphs(documentation, names))
    lines.extend(filter(None, (python_declaration(m, node.name) for m in members)))
    return "\n\n".join(lines).replace("\n", "\n   ")


def add_python(app, docname, source):
    """docs/api/python.md has the docstring of each name in the place of the link to its source."""
    exported = ast.parse((ROOT / "python/fcl_fibers/__init__.py").read_text()).body[-1]
    missing = set(ast.literal_eval(exported.value)) - {"__version__"}  # of __all__

    def directive(match):
        missing.discard(match[1])
        module = ast.parse((ROOT / "python/fcl_fibers" / match[2]).read_text())
        node = next(node for node in module.body if getattr(node, "name", "") == match[1])
        return f"```{{eval-rst}}\n{python_declaration(node)}\n```"

    if docname == "docs/api/python":
        link = r"^\[`(\w+)`\]\(\.\./\.\./python/fcl_fibers/(.*\.py)\)$"
        source[0] = re.sub(link, directive, source[0], flags=re.MULTILINE)
        for name in sorted(missing):
            LOGGER.warning(f"{name} of Python is not in docs/api/python.md")


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


def add_measured(app, docname, source):
    """Tables of docs/measured, folded, below the paragraph or list that links them. Rows of one
    cell at the end are what the table is of."""

    def table(path):
        with (ROOT / "docs" / path).open(encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
        notes = []
        while not any(rows[-1][1:]):
            notes.insert(0, rows.pop()[0])
        text = io.StringIO()
        csv.writer(text).writerows(rows)
        return "\n\n".join((f"```{{csv-table}}\n:header-rows: 1\n\n{text.getvalue()}```", *notes))

    def shown(block):
        for title, path in re.findall(r"\[([^]]+)\]\((measured/[\w.-]+\.csv)\)", block):
            title = " ".join(title.split())
            block += f"\n\n<details><summary>{title}</summary>\n\n{table(path)}\n\n</details>"
        return block

    if docname == "docs/measured":
        source[0] = "\n\n".join(map(shown, source[0].split("\n\n")))


def mark_wide_tables(app, doctree):
    """Those that site.css breaks to show their last column, and the names that it may break."""
    for table in doctree.findall(nodes.table):
        columns = zip(*(row.children for row in table.findall(nodes.row)))
        if sum(3 + max(len(cell.astext()) for cell in column) for column in columns) > 125:
            table["classes"].append("wide")
            for code in table.findall(nodes.literal):
                if len(code.astext()) > 24:
                    code["classes"].append("long")


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
    app.connect("source-read", add_measured)
    app.connect("doctree-read", mark_wide_tables)
    # Before Sphinx collects downloads.
    app.connect("doctree-read", prepare_links, priority=400)
    app.connect("missing-reference", resolve_source)
    app.connect("html-collect-pages", listings)
    app.connect("doctree-resolved", add_live_pages)
