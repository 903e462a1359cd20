"""Files under the names that the documentation's examples use: a floor, a table and two boxes before a camera that looks down by 30
degrees, and a random-dot stereo pair. Python's own library alone."""

from __future__ import annotations

import math
import random
import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

WIDTH, HEIGHT = 320, 240
FOCAL = 300.0
CAMERA = f"{FOCAL:g},{FOCAL:g},{WIDTH / 2:g},{HEIGHT / 2:g}"
TILT = math.radians(30)
EYE = 1.5  # [m] above the floor

#: x, y (away from the camera), z (up): low corner, high corner; colour. The floor is z = 0.
BOXES = [
    ((-0.6, 1.4, 0.0), (0.6, 2.4, 0.7), (150, 110, 70)),
    ((-0.35, 1.6, 0.7), (-0.15, 1.8, 0.9), (200, 40, 40)),
    ((0.1, 1.7, 0.7), (0.35, 1.9, 0.85), (40, 60, 190)),
]

Pixel = tuple[float, tuple[int, int, int]]  # depth along the optical axis [m], colour


def look(u: int, v: int) -> Pixel:
    """What the ray through a pixel meets first."""
    right, down = (u - WIDTH / 2) / FOCAL, (v - HEIGHT / 2) / FOCAL
    ray = (right, math.cos(TILT) - down * math.sin(TILT), -math.sin(TILT) - down * math.cos(TILT))
    best: Pixel = (math.inf, (0, 0, 0))
    if ray[2] < 0:
        best = (EYE / -ray[2], (120, 125, 115))
    eye = (0.0, 0.0, EYE)
    for low, high, colour in BOXES:
        near, far = 0.0, math.inf
        for k in range(3):
            if ray[k] == 0:
                continue
            a, b = sorted(((low[k] - eye[k]) / ray[k], (high[k] - eye[k]) / ray[k]))
            near, far = max(near, a), min(far, b)
        if near < far and near < best[0]:
            best = (near, colour)
    return best if best[0] < 6 else (math.nan, best[1])


def frame(seed: int) -> list[Pixel]:
    noise = random.Random(seed)
    seen = []
    for v in range(HEIGHT):
        for u in range(WIDTH):
            z, colour = look(u, v)
            shade = noise.randint(-8, 8)
            seen.append((z + noise.gauss(0, 0.001), tuple(max(0, min(255, c + shade)) for c in colour)))
    return seen  # type: ignore[return-value]


def xyz(pixels: list[Pixel]) -> list[tuple[float, float, float]]:
    return [
        ((i % WIDTH - WIDTH / 2) / FOCAL * z, (i // WIDTH - HEIGHT / 2) / FOCAL * z, z) for i, (z, _) in enumerate(pixels)
    ]


def write_pcd(file: Path, pixels: list[Pixel]) -> None:
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n"
        f"WIDTH {WIDTH}\nHEIGHT {HEIGHT}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(pixels)}\nDATA binary\n"
    )
    rows = (struct.pack("<fffI", *p, r << 16 | g << 8 | b) for p, (_, (r, g, b)) in zip(xyz(pixels), pixels))
    file.write_bytes(head.encode() + b"".join(rows))


def write_ply(file: Path, pixels: list[Pixel]) -> None:
    finite = [p for p in xyz(pixels) if math.isfinite(p[2])]
    head = f"ply\nformat ascii 1.0\nelement vertex {len(finite)}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    file.write_text(head + "".join(f"{x:.5f} {y:.5f} {z:.5f}\n" for x, y, z in finite))


def write_png(file: Path, width: int, height: int, rows: Sequence[bytes], depth: int, colour: int) -> None:
    """`colour`: 0 grey, 2 RGB; `depth`: bits a channel."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    data = zlib.compress(b"".join(b"\0" + row for row in rows))
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


def write_rgbd(color: Path, depth: Path, pixels: list[Pixel]) -> None:
    lines = [pixels[v * WIDTH : (v + 1) * WIDTH] for v in range(HEIGHT)]
    write_png(color, WIDTH, HEIGHT, [bytes(c for _, rgb in line for c in rgb) for line in lines], 8, 2)
    millimetres = [[round(z * 1000) if math.isfinite(z) else 0 for z, _ in line] for line in lines]
    write_png(depth, WIDTH, HEIGHT, [struct.pack(f">{WIDTH}H", *line) for line in millimetres], 16, 0)


def write_stereo(left: Path, right: Path, calib: Path) -> None:
    """A floor seen from above its horizon: disparity grows downwards."""
    dots = random.Random(1)
    lefts, rights = [], []
    for v in range(HEIGHT):
        row = bytes(dots.randint(30, 225) for _ in range(WIDTH))
        d = max(2, v // 8)
        lefts.append(bytes(c for x in row for c in (x, x, x)))
        rights.append(bytes(c for x in row[d:] + row[:d] for c in (x, x, x)))
    write_png(left, WIDTH, HEIGHT, lefts, 8, 2)
    write_png(right, WIDTH, HEIGHT, rights, 8, 2)
    camera = f"[{FOCAL} 0 {WIDTH / 2}; 0 {FOCAL} {HEIGHT / 2}; 0 0 1]"
    calib.write_text(
        f"cam0={camera}\ncam1={camera}\ndoffs=0\nbaseline=100\nwidth={WIDTH}\nheight={HEIGHT}\nndisp=40\n"
    )


def write_all(folder: Path) -> None:
    pixels, later = frame(1), frame(2)
    for name in ("room.pcd", "room_scan1.pcd", "table.pcd", "cloud.pcd"):
        write_pcd(folder / name, pixels)
    write_ply(folder / "scan.ply", pixels)
    write_rgbd(folder / "C.png", folder / "D.png", pixels)
    write_stereo(folder / "L.png", folder / "R.png", folder / "calib.txt")
    (folder / "frames").mkdir()
    write_pcd(folder / "frames/frame2.pcd", pixels)
    write_pcd(folder / "frames/frame10.pcd", later)
    (folder / "rgbd").mkdir()
    for number, seen in ((7, pixels), (8, later)):
        write_rgbd(folder / f"rgbd/{number}.color.png", folder / f"rgbd/{number}.depth.png", seen)
