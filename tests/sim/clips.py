"""Clips that tests encode: noise of the palette, and planes as they are given."""

import io

import av
import numpy as np

from mpmworlds.sim.run.encode import X264
from mpmworlds.sim.scene.palette import PALETTE, rgb

COLORS = np.array([(0, 0, 0), *map(rgb, PALETTE.values())], np.uint8)


def noise(count, side, seed=0):
    """Palette colours: neighbours differ, so that a wrong pixel is seen."""
    rng = np.random.default_rng(seed)
    return COLORS[rng.integers(0, len(COLORS), (count, side, side))]


def video_of(planes, pixel_format="yuv444p", color_range=1, matrix=6):
    """Encode pictures given as planes Y, U, V (T, 3, N, N), losslessly."""
    file = io.BytesIO()
    with av.open(file, "w", format="mp4") as container:
        options = X264 | {"preset": "ultrafast"}
        stream = container.add_stream("libx264", rate=30, options=options)
        stream.height, stream.width = planes.shape[2:]
        stream.pix_fmt = pixel_format
        stream.codec_context.color_range = color_range
        stream.codec_context.colorspace = matrix
        for picture in planes:
            frame = av.VideoFrame(*planes.shape[:1:-1], pixel_format)
            frame.colorspace, frame.color_range = matrix, color_range
            for plane, values in zip(frame.planes, picture, strict=True):
                rows = np.asarray(memoryview(plane))
                shaped = rows.reshape(plane.height, plane.line_size)
                shaped[:, : plane.width] = values[: plane.height, : plane.width]
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return file.getvalue()
