# SPDX-License-Identifier: MIT OR Apache-2.0
"""The report's drawings as PNG: the few SVG elements that they are made of, and no others."""

from __future__ import annotations

import base64
import io
import re
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from xml.etree.ElementTree import Element

    from PIL import Image as Pillow
    from PIL.ImageDraw import ImageDraw

    Points = list[tuple[float, float]]
    Attributes = Mapping[str, str]

_WIDTH = 1400  # pixels of the picture, at least
_DOTS = 10.0  # pixels of a mm of paper, 254 of an inch
_WIDEST = 6000.0  # pixels of paper; large sheets are coarser
_SMOOTH = 2  # drawn so many times larger and made smaller, for edges without steps
_HREF = "{http://www.w3.org/1999/xlink}href"
_STEP = re.compile(r"([MLHVZ])([^MLHVZ]*)")
_NUMBER = re.compile(r"-?[\d.]+(?:e-?\d+)?")
# The font that comes with Pillow has Latin letters only.
_SPELLED = str.maketrans({
    "\N{EN DASH}": "-", "\N{MINUS SIGN}": "-", "\N{MULTIPLICATION SIGN}": "x", "\N{DIVISION SIGN}": "/",
    "\N{GREEK SMALL LETTER SIGMA}": "sigma", "\N{SUPERSCRIPT TWO}": "2", "\N{LESS-THAN OR EQUAL TO}": "<",
})  # fmt: skip


def rasterize(drawing: str) -> bytes:
    """Return a drawing of this package, an SVG element, as a PNG picture on white paper.

    Raises
    ------
    ValueError
        If it has an element that the drawings of this package do not have.
    """
    root = ET.fromstring(drawing)
    return _written(_drawn(root, max(1.0, _WIDTH / _size(root)[0])), "PNG")


def rasterize_paper(drawing: str, kind: str) -> bytes:
    """Return a drawing whose unit is the millimetre as a PNG or PDF that prints at its size.

    Raises
    ------
    ValueError
        If it has an element that the drawings of this package do not have.
    """
    root = ET.fromstring(drawing)
    scale = min(_DOTS, _WIDEST / _size(root)[0])
    inch = 25.4 * scale
    details: dict[str, Any] = {"resolution": inch} if kind == "PDF" else {"dpi": (inch, inch)}
    return _written(_drawn(root, scale), kind, **details)


def _size(root: Element) -> tuple[float, float]:
    width, height = (float(v) for v in root.attrib["viewBox"].split()[2:])
    return width, height


def _drawn(root: Element, pixels: float) -> Pillow.Image:
    """Draw an SVG element on white, with so many pixels for its unit."""
    from PIL import Image, ImageDraw  # slow to import, so only when it is needed

    scale = _SMOOTH * pixels
    width, height = (round(v * scale) for v in _size(root))
    canvas = _Canvas(Image.new("RGB", (width, height), "white"), scale, _gradients(root))
    canvas.draw = ImageDraw.Draw(canvas.image, "RGBA")
    for element in root:
        canvas.add(element)
    return canvas.image.resize((width // _SMOOTH, height // _SMOOTH), Image.Resampling.BOX)


def _written(picture: Pillow.Image, kind: str, **details: Any) -> bytes:  # noqa: ANN401 - Pillow's
    written = io.BytesIO()
    picture.save(written, kind, **details)
    return written.getvalue()


class _Canvas:
    """A picture on which elements are drawn one after the other."""

    draw: ImageDraw

    def __init__(
        self, image: Pillow.Image, scale: float, gradients: dict[str, list[tuple[float, str]]]
    ) -> None:
        self.image = image
        self._scale = scale
        self._gradients = gradients
        self._draws: dict[str, Callable[[Attributes, str], None]] = {
            "rect": self._rect, "line": self._line, "polyline": self._polyline, "path": self._path,
            "polygon": self._polygon, "circle": self._circle, "text": self._text,
            "image": self._image, "defs": lambda *_: None, "style": lambda *_: None,
        }  # fmt: skip

    def add(self, element: Element) -> None:
        """Draw one element."""
        kind = element.tag.rsplit("}", 1)[-1]
        if kind not in self._draws:
            msg = f"drawing: expected {', '.join(self._draws)}, got an element {kind}"
            raise ValueError(msg)
        self._draws[kind](element.attrib, element.text or "")

    def _at(self, a: Attributes, *names: str) -> list[float]:
        return [self._scale * float(a.get(name, 0.0)) for name in names]

    def _rect(self, a: Attributes, _: str) -> None:
        if a.get("width") == "100%":
            self.draw.rectangle((0, 0, *self.image.size), fill=a["fill"])
            return
        x, y, w, h = self._at(a, "x", "y", "width", "height")
        stops = self._gradients.get(a.get("fill", "")[5:-1])
        if stops is not None:
            self._gradient((x, y, w, h), stops)
            return
        corners = [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]
        self._shape(a, corners)

    def _gradient(self, at: tuple[float, ...], stops: list[tuple[float, str]]) -> None:
        from PIL import ImageColor

        x, y, w, h = at
        n = len(stops) - 1
        for column in range(round(w)):
            share = column / max(w - 1, 1) * n
            k = min(int(share), n - 1)
            one, other = (ImageColor.getrgb(stops[i][1]) for i in (k, k + 1))
            mixed = tuple(round(p + (share - k) * (q - p)) for p, q in zip(one, other, strict=True))
            self.draw.line((x + column, y, x + column, y + h), fill=mixed)

    def _line(self, a: Attributes, _: str) -> None:
        x1, y1, x2, y2 = self._at(a, "x1", "y1", "x2", "y2")
        self._stroke(a, [(x1, y1), (x2, y2)])

    def _polyline(self, a: Attributes, _: str) -> None:
        self._stroke(a, self._pairs(a["points"]))

    def _polygon(self, a: Attributes, _: str) -> None:
        self._shape(a, self._pairs(a["points"]))

    def _circle(self, a: Attributes, _: str) -> None:
        x, y, r = self._at(a, "cx", "cy", "r")
        width = max(round(self._width(a)), 1)
        outline = _ink(a, "stroke", "none")
        self.draw.ellipse((x - r, y - r, x + r, y + r), _ink(a, "fill", "black"), outline, width)

    def _path(self, a: Attributes, _: str) -> None:
        """Draw the straight steps of a path."""
        line: Points = []
        for step, values in _STEP.findall(a["d"]):
            numbers = [self._scale * float(v) for v in _NUMBER.findall(values)]
            if step == "M" and line:
                self._stroke(a, line)
                line = []
            if step in "ML":
                line += list(zip(numbers[::2], numbers[1::2], strict=True))
            elif step == "Z":
                line.append(line[0])
            else:
                line += [(v, line[-1][1]) if step == "H" else (line[-1][0], v) for v in numbers]
        self._stroke(a, line)

    def _text(self, a: Attributes, content: str) -> None:
        from PIL import ImageFont

        x, y = self._at(a, "x", "y")
        anchor = {"start": "ls", "middle": "ms", "end": "rs"}[a.get("text-anchor", "start")]
        font = ImageFont.load_default(self._scale * float(a.get("font-size", 12)))
        self.draw.text((x, y), content.translate(_SPELLED), _ink(a, "fill", "black"), font, anchor)

    def _image(self, a: Attributes, _: str) -> None:
        from PIL import Image

        data = base64.b64decode((a.get("href") or a[_HREF]).split(",", 1)[1])
        x, y, w, h = (round(v) for v in self._at(a, "x", "y", "width", "height"))
        picture = Image.open(io.BytesIO(data)).convert("RGB")
        self.image.paste(picture.resize((w, h), Image.Resampling.BILINEAR), (x, y))

    def _shape(self, a: Attributes, corners: Points) -> None:
        ink = _ink(a, "fill", "black")
        if ink is not None:
            self.draw.polygon(corners, fill=ink)
        self._stroke(a, [*corners, corners[0]])

    def _stroke(self, a: Attributes, line: Points) -> None:
        ink = _ink(a, "stroke", "none")
        if ink is not None and len(line) > 1:
            self.draw.line(line, fill=ink, width=max(round(self._width(a)), 1), joint="curve")

    def _width(self, a: Attributes) -> float:
        return self._scale * float(a.get("stroke-width", 1.0))

    def _pairs(self, points: str) -> Points:
        values = [self._scale * float(v) for v in _NUMBER.findall(points)]
        return list(zip(values[::2], values[1::2], strict=True))


def _gradients(root: Element) -> dict[str, list[tuple[float, str]]]:
    found = {}
    for element in root.iter():
        if element.tag.endswith("linearGradient"):
            stops = [(float(s.attrib["offset"]), s.attrib["stop-color"]) for s in element]
            found[element.attrib["id"]] = stops
    return found


def _ink(a: Attributes, kind: str, default: str) -> tuple[int, ...] | None:
    """Return the colour with its opacity, or None where nothing is drawn."""
    from PIL import ImageColor

    name = a.get(kind, default)
    if name == "none":
        return None
    opacity = float(a.get(f"{kind}-opacity", 1.0))
    return (*ImageColor.getrgb(name)[:3], round(255 * opacity))
