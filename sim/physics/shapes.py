"""Signed distance [m] and outward normal of shapes, in the frame of the shape.

Every function returns (d, nx, ny): d < 0 inside.
"""

import taichi as ti
from taichi.math import cconj, cmul, vec2, vec3


@ti.func
def sd_box(p, size):
    """Box of width and height `size` [m] around the origin."""
    q = abs(p) - 0.5 * vec2(size)
    side = ti.select(p < 0.0, -1.0, 1.0)
    out = ti.max(q, 0.0)
    far = out.norm()
    n = side * vec2(ti.select(q.x > q.y, 1.0, 0.0), ti.select(q.x > q.y, 0.0, 1.0))
    if far > 0.0:
        n = side * out / far
    return vec3(far + ti.min(q.max(), 0.0), n)


@ti.func
def sd_rounded_box(p, size, corner_radius):
    """Box of width and height `size` [m] with corners of the given radius [m]."""
    return sd_box(p, size - 2.0 * corner_radius) - vec3(corner_radius, 0.0, 0.0)


@ti.func
def sd_circle(p, radius):
    """Disc of the given radius [m] around the origin."""
    r = p.norm()
    return vec3(r - radius, p / ti.max(r, 1e-9))


@ti.func
def sd_ellipse(p, semi_axes):
    """Ellipse of the given semi-axes [m] along x and y.

    The nearest point is semi_axes * t, sought by fitting circles of curvature at t.
    """
    q, square = abs(p), semi_axes * semi_axes
    t, turn = vec2(0.7), vec2(square.x - square.y, square.y - square.x) / semi_axes
    for _ in range(4):
        middle = turn * t * t * t  # of the circle of curvature
        arm, away = semi_axes * t - middle, q - middle
        far = ti.max(away.norm(), 1e-9)
        t = ti.max((middle + away * arm.norm() / far) / semi_axes, 1e-9).normalized()
    n = (t / semi_axes).normalized()
    return vec3(n.dot(q - semi_axes * t), ti.select(p < 0.0, -n, n))


@ti.func
def sd_capsule(p, length, radius):
    """Points within a radius [m] of a segment of the x axis of the given length [m]."""
    q = vec2(p.x - ti.min(ti.max(p.x, -0.5 * length), 0.5 * length), p.y)
    r, n = q.norm(), vec2(0.0, 1.0)
    if r > 0.0:
        n = q / r
    return vec3(r - radius, n)


@ti.func
def sd_ring(p, radius, thickness, opening_deg):
    """Round-ended ring of the given radius and thickness [m], open around +y [deg]."""
    half, side = 0.5 * ti.math.radians(opening_deg), ti.select(p.x < 0.0, -1.0, 1.0)
    end = radius * vec2(side * ti.sin(half), ti.cos(half))
    arm, offset = p, p.norm() - radius
    if side * (p.y * end.x - p.x * end.y) > 0.0:  # in the opening
        arm, offset = p - end, (p - end).norm()
    n = ti.select(offset < 0.0, -1.0, 1.0) * arm / ti.max(arm.norm(), 1e-9)
    return vec3(abs(offset) - 0.5 * thickness, n)


@ti.func
def sd_polygon(p, corners: ti.template(), k, count):
    """Simple polygon whose `count` corners [m] are row k of a field, in any winding."""
    nearest, inside, start = vec2(1e9, 0.0), 1.0, corners[k, count - 1]
    for i in range(count):
        end = corners[k, i]
        edge, w = end - start, p - start
        w -= edge * ti.min(ti.max(w.dot(edge) / edge.dot(edge), 0.0), 1.0)
        if w.dot(w) < nearest.dot(nearest):
            nearest = w
        if (start.y > p.y) != (end.y > p.y):
            if p.x < start.x + (p.y - start.y) * edge.x / edge.y:
                inside = -inside
        start = end
    d = nearest.norm()
    return vec3(inside * d, inside * nearest / ti.max(d, 1e-9))


@ti.func
def sd_fan(p, blade_count, blade_length, thickness):
    """Straight round-ended blades of the given length and thickness [m] from a hub."""
    sector = 2.0 * ti.math.pi / blade_count
    angle = sector * ti.round(ti.atan2(p.y, p.x) / sector)
    turn = vec2(ti.cos(angle), ti.sin(angle))
    q = cmul(p, cconj(turn))
    q.x -= ti.min(ti.max(q.x, 0.0), blade_length)
    r = q.norm()
    return vec3(r - 0.5 * thickness, cmul(turn, q) / ti.max(r, 1e-9))
