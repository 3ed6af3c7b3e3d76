"""Configuration of Sphinx for the documentation site, which scripts/docs builds.

The sources are the Markdown files where they are. Sphinx adds a table of contents to the README, and
comments of headers to the pages of docs/reference.
"""

import pathlib
import re
import sys

from sphinx import addnodes

root = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(root / "python"))

project = "jfpx"
release = re.search(r"project\(jfpx VERSION (\S+)", (root / "CMakeLists.txt").read_text())[1]
extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "README"
include_patterns = ["README.md", "CHANGELOG.md", "docs/*.md", "docs/reference/*.md", "bench/results/*.md",
                    "packaging/README.md"]
exclude_patterns = ["build*", "bundle*", ".*"]  # not searched

html_theme = "furo"
html_title = f"jfpx {release}"
html_theme_options = {"navigation_with_keys": True}
html_static_path = ["style.css"]
html_css_files = ["style.css"]
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
pygments_style = "friendly"
toc_object_entries_show_parents = "hide"
cpp_maximum_signature_line_length = 100
python_maximum_signature_line_length = 100

myst_heading_anchors = 6  # named as on GitHub

breathe_projects = {"jfpx": str(root / "build/docs/doxygen/xml")}
breathe_default_project = "jfpx"

autodoc_mock_imports = ["jfpx._core"]  # not built
autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
napoleon_use_ivar = True

# Breathe declares a namespace once for each header.
suppress_warnings = ["duplicate_declaration.cpp"]


def name_headers_by_path(app):
    """Doxygen's index names headers without their folders, but two are called world.hpp."""
    doxygen = pathlib.Path(app.config.breathe_projects["jfpx"])
    index = (doxygen / "index.xml").read_text()
    for header in doxygen.glob("*_8hpp.xml"):
        path = re.findall(r'<location file="include/([^"]+)"/>', header.read_text())[-1]
        index = re.sub(rf'(refid="{header.stem}" kind="file"><name>)[^<]*', rf"\g<1>{path}", index)
    (doxygen / "index.xml").write_text(index)


def extend_source(app, docname, source):
    """Adds what Markdown without Sphinx has no use for."""
    if docname == "README":
        source[0] += "\n" + (root / "docs/site/contents.md").read_text()
    elif docname == "bench/results/README":
        source[0] += "\n```{toctree}\n:hidden:\n:glob:\n\n*\n```\n"
    elif docname.startswith("docs/reference/"):
        kinds = [f"{access}-{kind}" for access in ("public", "protected")
                 for kind in ("type", "static-func", "func", "static-attrib", "attrib")]
        sections = ["briefdescription", "detaileddescription", "innernamespace", "innerclass", "enum",
                    "typedef", "func", "var", "define", *kinds, "friend"]
        source[0] = "---\ntocdepth: 3\n---\n" + re.sub(
            r"^## (jfpx/\S+)$",
            rf"\g<0>\n\n```{{doxygenfile}} \1\n:sections: {' '.join(sections)}\n```", source[0], flags=re.M)


def unwrap_namespaces(app, doctree):
    """Shows what is in a namespace without an entry for the namespace itself."""
    for entry in list(doctree.findall(addnodes.desc)):
        if entry[0].astext().startswith("namespace "):
            place = entry.parent.index(entry)
            entry.parent[place:place + 1] = entry[1].children


def skip_tuple_fields(app, what, name, member, skip, options):
    """The docstring of a tuple describes its fields, too."""
    return True if type(member).__name__ == "_tuplegetter" else None


def setup(app):
    app.connect("builder-inited", name_headers_by_path)
    app.connect("source-read", extend_source)
    app.connect("doctree-read", unwrap_namespaces, priority=1)  # before names are collected
    app.connect("autodoc-skip-member", skip_tuple_fields)
