"""Cuts KaTeX's fonts down to the glyphs of src/ui/math.rs, and writes down their measures (TrueType lacks some).

    npm pack katex && tar xzf katex-*.tgz && pip install fonttools && python web/fonts/cut_math.py package
"""

import json
import re
import string
import sys
from pathlib import Path

from fontTools.subset import main as subset

FONTS = {  # name here and KaTeX's, glyphs
    ("Roman", "Main-Regular"): string.ascii_lowercase + string.digits + "()[]+,-./:;=˜−∣≥≤∝∈⋅×≈∞→∼′…ΔΣ\ue020",
    ("Italic", "Math-Italic"): string.ascii_lowercase + "ACDEGHJKLMNPQRSTVXαβγδεθλμπρστφϕϵ",
    ("Double", "AMS-Regular"): "EPR",
    ("Sum", "Size1-Regular"): "∑∏",
    ("BigSum", "Size2-Regular"): "∑∏",
}

katex, here = Path(sys.argv[1]), Path(__file__).parent
source = (katex / "src/fontMetricsData.js").read_text()
table = json.loads(re.sub(r",(\s*})", r"\1", source[source.index("{") : source.rindex("}") + 1]))
lines = ["font glyph width height depth italic-correction skew, in 1/1000 em; written by cut_math.py from KaTeX's metrics"]
for (name, font), glyphs in FONTS.items():
    # Without names: a changed font may not bear the reserved ones. Copyright and licence are in OFL.txt.
    options = ["--no-hinting", "--notdef-outline", "--no-glyph-names", "--name-IDs="]
    files = [str(katex / f"dist/fonts/KaTeX_{font}.ttf"), f"--output-file={here / f'Math{name}.ttf'}"]
    subset([*files, f"--text={glyphs}", *options])
    for glyph in glyphs:
        depth, height, italic, skew, width = (round(1000 * x) for x in table[font][str(ord(glyph))])
        lines.append(f"{name} {glyph} {width} {height} {depth} {italic} {skew}")
(here / "math.txt").write_text("\n".join(lines) + "\n")
