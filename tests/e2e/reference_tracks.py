# SPDX-License-Identifier: Apache-2.0
"""Errors of trajectories, computed in another way than dsg-eval does.

Matrices instead of quaternions, Horn's eigenvector instead of a singular value decomposition,
Newton's iteration for nearest rotations and for the best yaw, maps of the rotation group instead of
slerp. Plain Python, so that it runs where the tests run; a few seconds for 5000 poses.

Sources: Horn, "Closed-form solution of absolute orientation using unit quaternions", 1987; Higham,
"Computing the polar decomposition", 1986.
"""

import decimal
import math
import statistics

NS_PER_S = 1_000_000_000


# A pose is (rotation as three rows, position).

def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def transposed(a):
    return [list(row) for row in zip(*a)]


def turned(a, v):
    return [sum(a[i][k] * v[k] for k in range(3)) for i in range(3)]


def added(u, v, scale=1.0):
    return [a + scale * b for a, b in zip(u, v)]


def norm(v):
    return math.sqrt(sum(x * x for x in v))


def between(a, b):
    """a^-1 b of two poses."""
    back = transposed(a[0])
    return product(back, b[0]), turned(back, added(b[1], a[1], -1.0))


def log(rotation):
    r = rotation
    axis = [0.5 * (r[2][1] - r[1][2]), 0.5 * (r[0][2] - r[2][0]), 0.5 * (r[1][0] - r[0][1])]
    sine, cosine = norm(axis), 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1.0)
    if sine < 1e-300:
        return [0.0, 0.0, 0.0]
    return [x * math.atan2(sine, cosine) / sine for x in axis]


def angle(rotation):
    return norm(log(rotation))


def exp(v):
    """Rodrigues' formula; sin(t)/t and (1 - cos t)/t^2 by half angles, exact near zero."""
    t = norm(v)
    half = 1.0 if t < 1e-8 else math.sin(t / 2) / (t / 2)
    a = 1.0 if t < 1e-8 else math.sin(t) / t
    b = 0.5 * half * half
    x, y, z = v
    k = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    kk = product(k, k)
    return [[(i == j) + a * k[i][j] + b * kk[i][j] for j in range(3)] for i in range(3)]


def from_quaternion(x, y, z, w):
    n = x * x + y * y + z * z + w * w
    x, y, z, w = (v / math.sqrt(n) for v in (x, y, z, w))
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def inverse_transposed(a):
    cofactors = [[a[(i + 1) % 3][(j + 1) % 3] * a[(i + 2) % 3][(j + 2) % 3] -
                  a[(i + 1) % 3][(j + 2) % 3] * a[(i + 2) % 3][(j + 1) % 3]
                  for j in range(3)] for i in range(3)]
    determinant = sum(a[0][j] * cofactors[0][j] for j in range(3))
    return [[c / determinant for c in row] for row in cofactors]


def nearest_rotation(a):
    for _ in range(8):
        other = inverse_transposed(a)
        a = [[0.5 * (a[i][j] + other[i][j]) for j in range(3)] for i in range(3)]
    return a


def read_tum(path):
    """Ascending [(time_ns, pose)]; of rows with one stamp the first."""
    rows = []
    with open(path, encoding="utf-8") as lines:
        for line in lines:
            fields = line.split()
            if not fields or line.startswith("#"):
                continue
            time_ns = int((decimal.Decimal(fields[0]) * NS_PER_S).to_integral_value())
            if rows and rows[-1][0] == time_ns:
                continue
            values = [float(f) for f in fields[1:]]
            rows.append((time_ns, (from_quaternion(*values[3:]), values[:3])))
    return rows


def read_kitti(path):
    with open(path, encoding="utf-8") as lines:
        rows = [[float(f) for f in line.split()] for line in lines if line.strip()]
    return [(nearest_rotation([r[0:3], r[4:7], r[8:11]]), [r[3], r[7], r[11]]) for r in rows]


def associated(estimate, truth, gap_ns):
    """[(time_ns, estimate, truth)] with the truth interpolated at the estimate's stamps."""
    by_time = dict(truth)
    pairs, k = [], 0
    for time_ns, pose in estimate:
        if time_ns in by_time:
            pairs.append((time_ns, pose, by_time[time_ns]))
            continue
        while k + 1 < len(truth) and truth[k + 1][0] < time_ns:
            k += 1
        if k + 1 == len(truth) or truth[k][0] > time_ns or truth[k + 1][0] - truth[k][0] > gap_ns:
            continue
        (t0, a), (t1, b) = truth[k], truth[k + 1]
        f = (time_ns - t0) / (t1 - t0)
        turn = product(a[0], exp([f * x for x in log(product(transposed(a[0]), b[0]))]))
        pairs.append((time_ns, pose, (turn, added([(1 - f) * x for x in a[1]], b[1], f))))
    return pairs


def largest_eigenvector(a):
    """Of a symmetric matrix, by Jacobi's rotations."""
    n = len(a)
    a = [list(row) for row in a]
    v = [[float(i == j) for j in range(n)] for i in range(n)]
    for _ in range(60):
        for p in range(n - 1):
            for q in range(p + 1, n):
                if a[p][q] == 0.0:
                    continue
                theta = 0.5 * math.atan2(2 * a[p][q], a[q][q] - a[p][p])
                c, s = math.cos(theta), math.sin(theta)
                for k in range(n):
                    a[k][p], a[k][q] = c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]
                for k in range(n):
                    a[p][k], a[q][k] = c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]
                for k in range(n):
                    v[k][p], v[k][q] = c * v[k][p] - s * v[k][q], s * v[k][p] + c * v[k][q]
    best = max(range(n), key=lambda i: a[i][i])
    return [v[k][best] for k in range(n)]


def horn_rotation(s):
    """The rotation that makes the sum of e R' g largest; s[i][j] = sum e_i g_j."""
    n = [[s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]],
         [0, s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]],
         [0, 0, s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]],
         [0, 0, 0, s[2][2] - s[0][0] - s[1][1]]]
    for i in range(4):
        for j in range(i):
            n[i][j] = n[j][i]
    w, x, y, z = largest_eigenvector(n)
    return from_quaternion(x, y, z, w)


def best_yaw(s):
    """Newton's iteration on the slope of the gain, from the best of 360 yaws."""
    a, b = s[0][0] + s[1][1], s[0][1] - s[1][0]
    yaw = max((math.radians(d) for d in range(360)),
              key=lambda t: a * math.cos(t) + b * math.sin(t))
    for _ in range(20):
        slope = -a * math.sin(yaw) + b * math.cos(yaw)
        bend = -a * math.cos(yaw) - b * math.sin(yaw)
        yaw -= slope / bend
    return exp([0.0, 0.0, yaw])


def alignment(pairs, kind):
    """(scale, rotation, translation) that brings the estimates' positions onto the truth's."""
    if kind == "none":
        return 1.0, exp([0.0, 0.0, 0.0]), [0.0, 0.0, 0.0]
    count = len(pairs)
    mean_e = [math.fsum(e[1][i] for _, e, _ in pairs) / count for i in range(3)]
    mean_g = [math.fsum(g[1][i] for _, _, g in pairs) / count for i in range(3)]
    centred = [(added(e[1], mean_e, -1.0), added(g[1], mean_g, -1.0)) for _, e, g in pairs]
    s = [[math.fsum(e[i] * g[j] for e, g in centred) for j in range(3)] for i in range(3)]
    rotation = best_yaw(s) if kind == "yaw" else horn_rotation(s)
    scale = 1.0
    if kind == "sim3":
        gain = math.fsum(sum(x * y for x, y in zip(turned(rotation, e), g)) for e, g in centred)
        scale = gain / math.fsum(norm(e) ** 2 for e, _ in centred)
    return scale, rotation, added(mean_g, turned(rotation, mean_e), -scale)


def errors(pairs, kind, lengths_m=(1, 5, 10, 20), seconds=()):
    """What dsg-eval's JSON says of a trajectory, as far as it is a figure of errors."""
    scale, rotation, translation = alignment(pairs, kind)
    moved = [(t, (product(rotation, e[0]), added(translation, turned(rotation, e[1]), scale)), g)
             for t, e, g in pairs]
    misses = [norm(added(e[1], g[1], -1.0)) for _, e, g in moved]
    path = [0.0]
    for (_, _, a), (_, _, b) in zip(moved, moved[1:]):
        path.append(path[-1] + norm(added(b[1], a[1], -1.0)))
    out = {"scale": scale, "path_m": path[-1],
           "ate": {"rmse_m": math.sqrt(math.fsum(m * m for m in misses) / len(misses)),
                   "median_m": statistics.median(misses), "max_m": max(misses)},
           "rpe": [], "rpe_time": []}
    for length in lengths_m:
        off = segment_errors(moved, path, length)
        if off:
            out["rpe"].append({
                "length_m": length,
                "translation_percent": 100 * math.fsum(m for m, _ in off) / length / len(off),
                "rotation_deg_per_m": math.degrees(math.fsum(a for _, a in off)) / length /
                                      len(off),
                "segment_count": len(off)})
    for duration in seconds:
        times = [t for t, _, _ in moved]
        off = segment_errors(moved, times, duration * NS_PER_S, NS_PER_S // 10)
        if off:
            out["rpe_time"].append({
                "seconds": duration,
                "rmse_m": math.sqrt(math.fsum(m * m for m, _ in off) / len(off)),
                "rmse_deg": math.degrees(math.sqrt(math.fsum(a * a for _, a in off) / len(off))),
                "segment_count": len(off)})
    return out


def segment_errors(pairs, measure, length, excess_max=math.inf):
    """[(metres, radians)] from each pair to the first that is `length` of `measure` later."""
    out, end = [], 0
    for i, (_, e, g) in enumerate(pairs):
        while end < len(pairs) and measure[end] - measure[i] < length:
            end += 1
        if end == len(pairs):
            break
        if measure[end] - measure[i] - length > excess_max:
            continue
        turn, step = between(between(g, pairs[end][2]), between(e, pairs[end][1]))
        out.append((norm(step), angle(turn)))
    return out


def coverage(estimate, truth, reach_ns):
    """Share of the truth's time that is within `reach_ns` of an estimate."""
    begin, end = truth[0][0], truth[-1][0]
    spans = [(max(begin, t - reach_ns), min(end, t + reach_ns)) for t, _ in estimate
             if begin <= t <= end]
    marks = sorted([(a, 1) for a, _ in spans] + [(b, -1) for _, b in spans])
    covered, depth = 0, 0
    for (t, change), (after, _) in zip(marks, marks[1:]):
        depth += change
        covered += (after - t) * (depth > 0)
    return covered / (end - begin)
