"""The script of pictures in HTML pages and in widgets of notebooks."""

from __future__ import annotations

import base64
import functools
import html as markup
import importlib.resources
import re
import zlib
from typing import Any

_PAGE = """<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<title>{title}</title>
<style>html, body {{ margin: 0; height: 100%; background: #f6f7f8; overflow: hidden }}</style>
<body>
<script type="module">
{script}
await mount(document.body, {{ height: "100vh", scene: "{scene}", movie: "{movie}" }});
</script>
</body>
</html>
"""


@functools.cache
def script(exports: bool) -> str:
    """The modules of the viewer as one, which imports nothing."""
    text = ""
    for name in ("shaders.js", "renderer.js", "viewer.js"):
        module = importlib.resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
        module = re.sub(r"^import .*\n", "", module, flags=re.MULTILINE)
        text += re.sub(r"^export (?!default)", "", module, flags=re.MULTILINE)
    return text if exports else re.sub(r"^export default .*\n", "", text, flags=re.MULTILINE)


def html(scene: bytes, movie: bytes, *, title: str) -> str:
    """A page that shows a scene and its frames."""
    return _PAGE.format(title=markup.escape(title), script=script(False),
                        scene=base64.b64encode(zlib.compress(scene)).decode(), movie=base64.b64encode(movie).decode())


def frame(text: str, height: int, note: str) -> str:
    """A page inside the output of a notebook, and a note below it."""
    return (f'<iframe srcdoc="{markup.escape(text)}" style="width:100%;height:{height}px;border:0"></iframe>'
            f'<div style="font:12px sans-serif;color:#888">{markup.escape(note)}</div>')


@functools.cache
def _widget_class() -> Any:
    try:
        import anywidget
        import traitlets
    except ImportError:
        raise ImportError("a picture that follows a world needs the package anywidget: pip install anywidget "
                          "(in a clone of jfpx: pip install \".[view]\")") from None

    class ViewWidget(anywidget.AnyWidget):
        """The bytes of a View, which the front end draws."""

        _esm = script(True)
        height = traitlets.Int(480).tag(sync=True)
        scene = traitlets.Bytes(b"").tag(sync=True)
        frame = traitlets.Bytes(b"").tag(sync=True)
        movie = traitlets.Bytes(b"").tag(sync=True)

    return ViewWidget


def widget(scene: bytes, frame: bytes, movie: bytes, height: int) -> Any:
    """A widget that shows a scene and its frames. Raises ImportError without anywidget."""
    return _widget_class()(scene=scene, frame=frame, movie=movie, height=height)
