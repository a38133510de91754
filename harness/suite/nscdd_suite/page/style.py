"""One look for all figures, and how they are saved."""
import io
import re
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (after the backend is chosen)
from PIL import Image  # noqa: E402  (which matplotlib needs itself)

from ..record import aside  # noqa: E402

CCS, DCS, NLGS, INK, FAINT = "#b4532a", "#1f5f8b", "#5a5a5a", "#222222", "#d9d9d9"
SCHEMES = {"ccs": ("CCS", CCS, "s"), "dcs": ("DCS", DCS, "o")}
# Subdomains: muted, told apart by hue and by lightness; repeated beyond eight.
SUBDOMAINS = ("#4c78a8", "#e39c37", "#5f9e6e", "#b85450", "#8d6cab", "#8fbfc2", "#c9a66b", "#c97b9d")
# Multiplicity 0 (no contact), 1, 2, ...: pale for grains inside, dark where many subdomains meet.
MULTIPLICITY = ("#ffffff", "#dedcd5", "#f2b867", "#dd7a3b", "#b3382f", "#8f2347", "#6d1f57", "#4b1c5c", "#2c1650")

plt.style.use(Path(__file__).parent / "nscdd.mplstyle")


def multiplicity_colour(m):
    return MULTIPLICITY[min(int(m), len(MULTIPLICITY) - 1)]


def subdomain_colour(k):
    return SUBDOMAINS[int(k) % len(SUBDOMAINS)]


def blank(axis, text):
    axis.text(0.5, 0.5, text, ha="center", transform=axis.transAxes, color=NLGS)
    axis.set_axis_off()


def subdomain_ticks(axis, numbers):
    """A logarithmic axis of base 2 with a tick at each number of subdomains."""
    axis.set_xscale("log", base=2)
    axis.set_xticks(numbers, [str(n) for n in numbers])
    axis.minorticks_off()


def ideal(axis, most, style="--"):
    """Speed-up = processes, in a hundred points: on a logarithmic axis of processes and a linear one of speed-ups this is no straight line."""
    n = np.geomspace(1, most, 100)
    return axis.plot(n, n, style, color=NLGS, linewidth=1, label="ideal")[0]


def apart(figure, space=0.06):
    """More room between panels, so that the label of an axis does not touch the panel to its left."""
    figure.get_layout_engine().set(wspace=space)
    return figure


def shorter(svg):
    """The same picture in half the bytes: coordinates to a twentieth of a point, the style of equal marks once, no indentation."""
    svg = re.sub(rb"\n\s+", b"\n", re.sub(rb"<!--.*?-->", b"", svg))
    svg = re.sub(rb' (d|x|y|points)="[^"]*"', lambda found: re.sub(rb"\d+\.\d+", lambda x: b"%g" % round(float(x[0]), 1), found[0]), svg)

    def hoist(found):
        styles = set(re.findall(rb' style="([^"]*)"', found[2]))
        if len(styles) != 1 or found[2].count(b" style=") != found[2].count(b"<use "):
            return found[0]
        return b'<g%s style="%s">\n%s</g>' % (found[1], styles.pop(), re.sub(rb' style="[^"]*"', b"", found[2]))

    return re.sub(rb'<g((?: clip-path="[^"]*")?)>\n((?:<use [^>]*/>\n)+)</g>', hoist, svg)


def fewer_colours(png, colours=96):
    """Of a picture of thousands of shaded spheres: a sixth of the bytes, and the eye sees no difference."""
    stream = io.BytesIO()
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    picture.quantize(colours, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(stream, "png", optimize=True)
    return stream.getvalue()


def save(figure, folder, name, kind="svg"):
    """Writes NAME.svg for lines, NAME.png for pictures; returns the name of the file."""
    stream = io.BytesIO()
    figure.savefig(stream, format=kind, metadata={"Date": None} if kind == "svg" else {})
    plt.close(figure)
    aside(Path(folder) / f"{name}.{kind}", (shorter if kind == "svg" else fewer_colours)(stream.getvalue()))
    return f"{name}.{kind}"
