"""The lumped piston model, eqs. 1-9, with two thermal poles, and one candidate effect at a time.

Equations are those of the pages on the piston model and on model files. Lengths in um, times in s, drives in V, powers in W.
"""

import numpy as np
from numba import njit

# Table 1 of the paper: lengths, thickness, expansion difference, factor K, temperature coefficient.
NONINVERTED, INVERTED, OVERLAP = 250.0, 125.0, 120.0
PER_KELVIN = 2.22e-5 / 2.4
FACTOR = 0.921
XI = 3.92e-3
ROOM_K = 295.0

# Base parameters: four cold resistances (ohm), four thermal resistances (K/W), curvature coefficient, time constant of the fast
# pole (s), weight and time constant (s) of the second.
BASE = [f"R0_{k}" for k in range(4)] + [f"R_T_{k}" for k in range(4)] + ["beta", "fast", "weight", "second"]
# Sets of time constants that fits start from; those of the project's own fits.
TIMES = [(8e-3, 0.2, 0.04), (2e-3, 0.3, 0.02), (0.02, 0.3, 0.2)]

# Candidates: what each is called, its form, and start, lowest and highest value of each parameter, as `host-tool effect show`
# prints them.
CANDIDATES = [
    ("series-resistance", "", [(5.0, 0.0, 25.0)]),
    ("quadratic-tcr", "", [(-5.8e-7, -2.5e-6, 0.0)]),
    ("film-tcr", "", [(0.2, 0.0, 0.7)]),
    ("heat-loss-temperature", "linear", [(1e-3, 0.0, 1e-2)]),
    ("heat-loss-temperature", "air", [(1.0, 0.0, 4.0)]),
    ("heat-loss-temperature", "convection", [(0.3, 0.0, 10.0)]),
    ("radiation", "", [(1e-14, 0.0, 1e-13)]),
    ("gap-heat-loss", "", [(0.1, 0.0, 0.6), (330.0, 270.0, 800.0)]),
    ("substrate-warming", "", [(0.05, 0.0, 0.4), (5.0, 0.3, 200.0)]),
    ("crosstalk", "", [(0.02, 0.0, 0.3), (0.5, 0.0, 1.0)]),
    ("ambient-drift", "", [(1.0, -15.0, 15.0), (200.0, 30.0, 3000.0), (0.1, -10.0, 10.0), (0.1, -10.0, 10.0), (200.0, 60.0, 1500.0)]),
    ("thermal-lag", "", [(0.1, 0.0, 0.6), (0.03, 1e-4, 1.0)]),
    ("expansion-temperature", "", [(5e-4, 0.0, 3e-3)]),
    ("softening", "", [(0.02, 0.0, 0.5), (60.0, 15.0, 150.0), (0.3, 0.0, 1.0)]),
    ("initial-curl", "", [(-5e-4, -5e-3, 1e-3)]),
    ("electrostatic-pull", "", [(0.1, 0.0, 2.0), (330.0, 270.0, 3000.0)]),
    ("hysteresis", "", [(0.02, 0.0, 0.3), (10.0, 0.5, 60.0)]),
    ("creep", "", [(0.01, 0.0, 0.2), (5.0, 0.2, 60.0)]),
    ("resonance", "", [(1.0, 0.0, 1.5), (1500.0, 200.0, 2500.0), (5.0, 1.0, 300.0)]),
    ("sensor-offset", "", [(0.5, -10.0, 10.0)]),
    ("sensor-gain", "", [(0.02, -0.2, 0.2)]),
    ("sensor-nonlinearity", "", [(0.01, -0.15, 0.15), (200.0, 40.0, 800.0), (0.5, -20.0, 20.0)]),
    ("sensor-lag", "", [(1e-3, 0.0, 0.3), (0.5, 0.0, 1.0)]),
    ("end-stop", "", [(0.3, 0.0, 1.0), (120.0, 20.0, 400.0), (3.0, 0.3, 30.0)]),
]
(SERIES, QUADRATIC, FILM, LINEAR, AIR, CONVECTION, RADIATION, GAP, SUBSTRATE, CROSSTALK, DRIFT, LAG, EXPANSION, SOFTENING, CURL,
 PULL, HYSTERESIS, CREEP, RESONANCE, OFFSET, GAIN, BENT, READING_LAG, STOP) = range(len(CANDIDATES))
NONE = -1
# Iterations of power against temperature within a step, and the change that ends them (K).
ROUNDS, SAME_K = 6, 1e-5


@njit(cache=True)
def _z(curvature):
    """Eqs. 5 and 7-9 of a curvature in 1/um."""
    z = OVERLAP * np.sin(NONINVERTED * curvature)
    for length in (NONINVERTED, INVERTED):
        half = 0.5 * length * curvature
        sinc = np.sin(half) / half if abs(half) > 1e-12 else 1.0
        z += length * half * sinc * sinc
    return 2.0 * FACTOR * z


@njit(cache=True)
def _relax(x, tau, start, end, h):
    """A first-order lag after `h` with an input that runs straight."""
    if tau < 1e-9:
        return end
    behind = (end - start) / h * tau
    return end - behind + (x - start + behind) * np.exp(-h / tau)


@njit(cache=True)
def _play(state, x, radius):
    return min(max(state, x - radius), x + radius)


@njit(cache=True)
def _beyond(effect, t):
    """Loss beyond a loss in proportion, for a strength of 1 (K)."""
    if effect == LINEAR:
        return t * t
    if effect == AIR:
        return ROOM_K / 1.8 * (max(1.0 + t / ROOM_K, 0.0) ** 1.8 - 1.0) - t
    return t * (abs(t) / 100.0) ** 0.25


@njit(cache=True)
def simulate(duration_s, from_v, to_v, row, base, effect, p, resolution, rows):
    """Displacement (rows), currents (rows, 4) and mean temperature rise (rows) that the model predicts."""
    r0, r_t, beta = base[0:4], base[4:8], base[8]
    taus = np.array([base[9], base[11]])
    weights = np.array([1.0 - base[10], base[10]])
    z_out, i_out, t_out = np.zeros(rows), np.zeros((rows, 4)), np.zeros(rows)
    poles, heating = np.zeros((4, 2)), np.zeros(4)
    state, last = np.zeros((4, 3)), np.zeros(4)
    mirror, mirror_last = np.zeros(2), 0.0
    temperature, power, current, z = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4)
    rest = _z(p[0]) if effect == CURL else 0.0
    now, since, drive = 0.0, 0.0, np.zeros(4)
    reading = 0.0
    for n in range(len(duration_s)):
        length = duration_s[n]
        held = True
        for k in range(4):
            if from_v[n, k] != to_v[n, k]:
                held = False
            if from_v[n, k] != drive[k]:
                since = 0.0
        done = 0.0
        while done < length:
            h = resolution * (since + taus[0]) if held else length
            if length - done - h < 1e-9 * length:
                h = length - done
            begins = done == 0.0
            share = (done + h) / length
            gain = np.empty((2, 3))
            for q in range(2):
                e = np.exp(-h / taus[q])
                mean = taus[q] / h * (1.0 - e)
                gain[q, 0], gain[q, 1], gain[q, 2] = e, mean - e, 1.0 - mean
            arrives = weights[0] * gain[0, 2] + weights[1] * gain[1, 2]
            start, start_poles = np.empty(4), poles.copy()
            volts = np.empty(4)
            for k in range(4):
                volts[k] = from_v[n, k] + share * (to_v[n, k] - from_v[n, k])
            for part in range(2):
                # First the power at the drive that a jump leads to, then that at the step's end.
                if part == 0 and not begins:
                    for k in range(4):
                        start[k] = heating[k]
                    continue
                for turn in range(ROUNDS):
                    total = power.sum()
                    moved = 0.0
                    for k in range(4):
                        v = from_v[n, k] if part == 0 else volts[k]
                        if part == 1:
                            for q in range(2):
                                poles[k, q] = gain[q, 0] * start_poles[k, q] + gain[q, 1] * start[k] + gain[q, 2] * heating[k]
                        raw = weights[0] * poles[k, 0] + weights[1] * poles[k, 1]
                        t = raw
                        if effect == SUBSTRATE:
                            t = raw + state[k, 0]
                        elif effect == LAG:
                            t = raw + p[0] * (state[k, 0] - raw)
                        elif effect == DRIFT:
                            at = now + (h if part == 1 else 0.0)
                            angle = 2.0 * np.pi * at / p[4]
                            t = raw + p[0] * (1.0 - np.exp(-at / p[1]) + p[2] * np.sin(angle) + p[3] * (1.0 - np.cos(angle)))
                        grown = r0[k] * XI * t
                        r = r0[k] + grown
                        if effect == QUADRATIC:
                            r += p[0] * r0[k] * t * t
                        elif effect == FILM:
                            r -= p[0] * grown
                        r = max(r, 1e-3)
                        if effect == SERIES:
                            v = v * r / (r + p[0])
                        current[k] = v / r
                        power[k] = v * current[k]
                        x = r_t[k] * power[k]
                        if effect == LINEAR or effect == AIR or effect == CONVECTION:
                            x -= p[0] * _beyond(effect, t)
                        elif effect == RADIATION:
                            x -= p[0] * r_t[k] * (max(ROOM_K + t, 0.0) ** 4 - ROOM_K**4)
                        elif effect == GAP:
                            low = min(max(z[k], 0.0), 0.95 * p[1])
                            x -= p[0] * t * low / (p[1] - low)
                        elif effect == CROSSTALK:
                            opposite = power[(k + 2) % 4]
                            x += p[0] * r_t[k] * (total - power[k] - opposite + p[1] * opposite)
                        temperature[k] = t
                        if part == 0:
                            start[k] = x
                            heating[k] = x
                        else:
                            slope = -arrives * heating[k] * r0[k] * XI / r
                            step = (x - heating[k]) / (1.0 - slope)
                            heating[k] += step
                            moved = max(moved, abs(step))
                    if part == 0 and turn >= 1:
                        break
                    if part == 1 and moved < SAME_K:
                        break
            now += h
            if effect == SUBSTRATE:
                for k in range(4):
                    goal = p[0] * r_t[k] * power.sum() / 4.0
                    state[k, 0] = goal + (state[k, 0] - goal) * np.exp(-h / p[1])
            centre = 0.0
            for k in range(4):
                t = temperature[k]
                if effect == LAG:
                    raw = weights[0] * poles[k, 0] + weights[1] * poles[k, 1]
                    state[k, 0] = _relax(state[k, 0], p[1], last[k], raw, h)
                    last[k] = raw
                per_kelvin = beta * PER_KELVIN
                curvature = per_kelvin * t
                if effect == EXPANSION:
                    curvature *= 1.0 + p[0] * t
                elif effect == CURL:
                    curvature += p[0]
                elif effect == SOFTENING:
                    state[k, 0] = max(state[k, 0], t)
                    yielded = p[0] * max(state[k, 0] - p[1], 0.0) / 100.0
                    curvature -= yielded * (p[2] * curvature + (1.0 - p[2]) * per_kelvin * 100.0)
                z[k] = _z(curvature)
                x = z[k]
                if effect == CREEP:
                    for q, factor in enumerate((0.2, 1.0, 5.0)):
                        state[k, q] = _relax(state[k, q], factor * p[1], last[k], z[k], h)
                        x += p[0] * state[k, q] / 3.0
                    last[k] = z[k]
                elif effect == HYSTERESIS:
                    for q in range(3):
                        state[k, q] = _play(state[k, q], z[k], p[1] * (q + 1) / 3.0)
                        x += p[0] * (state[k, q] - z[k]) / 3.0
                elif effect == PULL:
                    x += p[0] * (volts[k] / (1.0 - min(max(z[k] / p[1], 0.0), 0.95))) ** 2
                elif effect == STOP:
                    over = (z[k] - p[1]) / p[2]
                    x -= p[0] * p[2] * (max(over, 0.0) + np.log1p(np.exp(-abs(over))))
                centre += 0.25 * x
            if effect == RESONANCE:
                omega, damping = 2.0 * np.pi * p[1], np.pi * p[1] / p[2]
                rate = (centre - mirror_last) / h
                behind = -2.0 * damping / omega**2 * rate
                off, speed = mirror[0] - behind, mirror[1] - rate
                ringing = max(np.sqrt(max(omega**2 - damping**2, 0.0)), 1e-9)
                s, c, decay = np.sin(ringing * h), np.cos(ringing * h), np.exp(-damping * h)
                quadrature = (speed + damping * off) / ringing
                swing = decay * (off * c + quadrature * s)
                mirror[0] = swing + behind
                mirror[1] = decay * ringing * (quadrature * c - off * s) - damping * swing + rate
                mirror_last = centre
                centre += p[0] * mirror[0]
            counted = centre - rest
            reading = counted
            if effect == OFFSET:
                reading = counted + p[0]
            elif effect == GAIN:
                reading = counted * (1.0 + p[0])
            elif effect == BENT:
                angle = 2.0 * np.pi * counted / p[1]
                reading = counted + p[0] * p[1] / (2.0 * np.pi) * (np.sin(angle) + p[2] * (1.0 - np.cos(angle)))
            elif effect == READING_LAG:
                first = _relax(mirror[0], p[0], mirror_last, counted, h)
                mirror[1] = _relax(mirror[1], p[0] * p[1], mirror[0], first, h)
                mirror[0], mirror_last = first, counted
                reading = mirror[1]
            since += h
            done += h
            if not np.isfinite(reading) or abs(temperature[0]) > 3e3:
                z_out[:] = np.inf
                return z_out, i_out, t_out
        for k in range(4):
            drive[k] = to_v[n, k]
        if row[n] >= 0:
            z_out[row[n]] = reading
            t_out[row[n]] = temperature.mean()
            for k in range(4):
                i_out[row[n], k] = current[k]
    return z_out, i_out, t_out
