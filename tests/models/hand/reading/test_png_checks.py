"""Pictures that models name: real ones pass unchanged, and small files that stand for gigabytes do not."""

import io
import zlib

import numpy as np
import pytest

from clench.models.hand.reading.png_checks import checked_png
from hostile.models import png

RNG = np.random.default_rng(0)
PIXELS = RNG.integers(0, 256, (37, 23, 4), dtype=np.uint8)


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "I;16"])
def test_pictures_of_every_kind_stay_as_they_are(mode):
    from PIL import Image

    if mode == "I;16":
        picture = Image.fromarray(RNG.integers(0, 65536, (37, 23)).astype(np.uint16))
    else:
        picture = Image.fromarray(PIXELS).convert("RGB" if mode == "P" else "RGBA").convert(mode)
    out = io.BytesIO()
    picture.save(out, "PNG")
    again = Image.open(io.BytesIO(checked_png(out.getvalue())))
    np.testing.assert_array_equal(np.asarray(again), np.asarray(picture))


def test_packed_text_is_left_out():
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    text, out = PngInfo(), io.BytesIO()
    text.add_text("x", "y" * 1_000_000, zip=True)
    Image.fromarray(PIXELS).save(out, "PNG", pnginfo=text)
    assert b"zTXt" in out.getvalue()
    assert b"zTXt" not in checked_png(out.getvalue())


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (png(60_000, 60_000), "it says that it has 60000 x 60000 pixels"),
        (png(8, 8, zlib.compress(bytes(10_000_000))), "it unpacks to more than its 8 x 8 pixels"),
        (png(8, 8, b"nothing packed"), "a damaged PNG file"),
        (png(0, 8), "it says that it has 0 x 8 pixels"),
        (png(8, 8)[:60], "a part of it is missing"),
        (png(8, 8)[:8], "not a PNG file"),
    ],
)
def test_what_is_refused(data, sentence):
    with pytest.raises(ValueError, match=sentence):
        checked_png(data)
