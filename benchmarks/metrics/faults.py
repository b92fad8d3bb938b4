"""What may become of a clip: benign changes, and failures of known size."""

from collections.abc import Iterator
from typing import NamedTuple

import av
import cv2
import numpy as np

from mpmworlds.metrics.clips import Clip, packed_colours


def noisy(clip: Clip, sigma: float, seed: int = 0) -> Clip:
    """Add Gaussian noise."""
    random = np.random.default_rng(seed)
    noise = random.normal(0.0, sigma, clip.shape).round()
    return (clip + noise).clip(0, 255).astype(np.uint8)


def recompressed(clip: Clip, crf: int = 23, framerate: int = 15) -> Clip:
    """Send a clip through H.264 4:2:0, as any video model's output goes."""
    codec = av.CodecContext.create("libx264", "w")
    codec.width, codec.height = clip.shape[2], clip.shape[1]
    codec.pix_fmt, codec.framerate = "yuv420p", framerate
    codec.options = {"crf": str(crf), "threads": "1"}
    packets = [
        packet
        for image in clip
        for packet in codec.encode(av.VideoFrame.from_ndarray(image, format="rgb24"))
    ]
    packets += codec.encode(None)
    decoder = av.CodecContext.create("h264", "r")
    if codec.extradata:
        decoder.extradata = codec.extradata
    frames = [frame for packet in packets for frame in decoder.decode(packet)]
    frames += decoder.decode(None)
    return np.stack([frame.to_ndarray(format="rgb24") for frame in frames])


def delayed(clip: Clip, frames: int) -> Clip:
    """Show every frame so much later."""
    return np.concatenate([np.repeat(clip[:1], frames, axis=0), clip[:-frames]])


class Body(NamedTuple):
    """A connected body of one colour at a frame."""

    colour: int
    area: int
    mask: Clip


def bodies(frame: Clip, smallest: int = 30) -> list[Body]:
    """Connected pieces of one colour, largest first."""
    packed, found = packed_colours(frame[None])[0], []
    for colour in np.unique(packed[packed > 0]).tolist():
        count, labels, stats, _ = cv2.connectedComponentsWithStats(
            (packed == colour).astype(np.uint8)
        )
        for k in range(1, count):
            area = int(stats[k, cv2.CC_STAT_AREA])
            if area >= smallest:
                found.append(Body(colour, area, labels == k))
    return sorted(found, key=lambda body: -body.area)


def popped_out(clip: Clip) -> Iterator[tuple[int, Clip]]:
    """A body of each colour that goes black for good at half time; its area."""
    half = len(clip) // 2
    packed, done = packed_colours(clip), set()
    for body in bodies(clip[half]):
        if body.colour not in done:
            done.add(body.colour)
            gone = clip.copy()
            gone[half:][packed[half:] == body.colour] = 0
            area = int(np.count_nonzero(packed[half] == body.colour))
            yield area, gone


def every_second_black(clip: Clip) -> Clip:
    """Flicker."""
    bad = clip.copy()
    bad[1::2] = 0
    return bad


def cut_to(clip: Clip, other: Clip) -> Clip:
    """Another sample from half time on."""
    half = len(clip) // 2
    return np.concatenate([clip[:half], other[half:]])


def recoloured(clip: Clip) -> Clip:
    """The commonest colour is another one from half time on."""
    half = len(clip) // 2
    packed = packed_colours(clip)
    colours, counts = np.unique(packed[half][packed[half] > 0], return_counts=True)
    bad = clip.copy()
    if colours.size:
        most = int(colours[counts.argmax()])
        other = (most & 0xFF, most >> 16, most >> 8 & 0xFF)  # channels in turn
        bad[half:][packed[half:] == most] = other
    return bad
