"""Voltage and current of heaters that are no mirrors', from materials and heat balances: writes the sessions beside it.

Shares nothing with the project's model or its virtual mirror. Temperatures are absolute (K), losses in W.
"""
import random

ROOM = 295.0
SIGMA = 5.670374e-8


def power_law(ohm, exponent):
    """Tungsten: about T^1.2."""
    return (lambda t: ohm * (t / ROOM) ** exponent), exponent / ROOM


def polynomial(ohm, first, second=0.0):
    return (lambda t: ohm * (1 + first * (t - ROOM) + second * (t - ROOM) ** 2)), first


def filament(area, ends):
    """Grey body whose emissivity grows with temperature, and its two ends."""
    return lambda t: area * (0.1 + 1.2e-4 * t) * SIGMA * (t**4 - ROOM**4) + ends * (t - ROOM)


def through_air(watt_per_kelvin):
    """Conduction through air, whose conductivity goes as T^0.8: integrated from the room to the heater."""
    return lambda t: watt_per_kelvin * (t**1.8 - ROOM**1.8) / (1.8 * ROOM**0.8)


def hot_wire(watt_per_kelvin):
    """A wire in slow air: film conductivity at the mean temperature."""
    return lambda t: watt_per_kelvin * (t - ROOM) * ((t + ROOM) / (2 * ROOM)) ** 0.75


def solid(watt_per_kelvin):
    return lambda t: watt_per_kelvin * (t - ROOM)


class Heater:
    def __init__(self, material, loss, leads=0.0, joule_per_kelvin=0.0):
        (self.ohm, self.per_kelvin), self.loss = material, loss
        self.leads, self.heat = leads, joule_per_kelvin

    def current(self, volts, t):
        return volts / (self.ohm(t) + self.leads)

    def gain(self, volts, t):
        return self.current(volts, t) ** 2 * self.ohm(t) - self.loss(t)

    def after(self, volts, t, seconds):
        """The temperature after a time at a voltage; at once where it stores no heat."""
        if self.heat == 0.0:
            low, high = ROOM - 1, 4000.0
            for _ in range(100):
                middle = (low + high) / 2
                low, high = (middle, high) if self.gain(volts, middle) > 0 else (low, middle)
            return low
        for _ in range(2000):
            t += seconds / 2000 * self.gain(volts, t) / self.heat
        return t


def measure(name, heater, volts, seed, ratio=1e-4, constant=2e-6, offset=0.0, digit=0.0, dwell=1.0):
    """Noise in proportion and constant (A), offset of the ammeter (A), its last digit (A)."""
    noise, t = random.Random(seed), ROOM
    with open(f"{name}.csv", "w") as file:
        file.write("# experiment=sweep\nt_s,V_V,I_A\n")
        for row, v in enumerate(volts):
            t = heater.after(v, t, dwell)
            i = heater.current(v, t)
            i += i * ratio * noise.gauss(0, 1) + constant * noise.gauss(0, 1) + offset
            i = round(i / digit) * digit if digit else i
            file.write(f"{(row + 1) * dwell:.1f},{v:.3f},{i:.7f}\n")
    with open(f"{name}.toml", "w") as file:
        file.write(
            'format = 1\npreset = "paper"\n\n[parameters]\n'
            f'R0 = {{ value = {heater.ohm(ROOM):.4g}, unit = "ohm" }}\n'
            f'xi = {{ value = {heater.per_kelvin:.3g}, unit = "1/K" }}\n'
            f'V_max = {{ value = {max(volts):.1f}, unit = "V" }}\n'
        )


def up(top, rows):
    return [top * (row + 1) / rows for row in range(rows)]


def up_and_down(top, rows):
    return up(top, rows) + up(top, rows)[-2::-1]


LAMP = power_law(2.2, 1.2)
POLY = polynomial(900.0, 1.1e-3)
measure("lamp", Heater(LAMP, filament(1.0e-5, 6e-5)), up_and_down(6.0, 40), 1)
measure("lamp-12v", Heater(power_law(1.1, 1.2), filament(3.0e-5, 2e-4)), up(12.0, 30), 2, ratio=1e-3, digit=1e-3)
measure("membrane", Heater(polynomial(110.0, 3.5e-3), through_air(1e-4)), up_and_down(3.0, 40), 3)
measure("wire", Heater(polynomial(8.0, 3.5e-3), hot_wire(2e-3)), up(4.0, 60), 4, ratio=5e-4)
measure("poly", Heater(POLY, solid(5e-5)), up_and_down(4.0, 30), 5)
measure("poly-poor-meter", Heater(POLY, solid(5e-5)), up(4.0, 24), 6, ratio=3e-3)
measure("poly-slow", Heater(POLY, solid(5e-5), joule_per_kelvin=1e-4), up_and_down(4.0, 40), 7, ratio=3e-4)
measure("kilohm-12v", Heater(polynomial(1000.0, 1e-3), solid(3e-4)), up_and_down(12.0, 30), 8, ratio=2e-4, offset=8e-6)
measure("leads", Heater(polynomial(100.0, 3e-3), solid(2e-4), leads=5.0), up_and_down(3.0, 30), 9, ratio=2e-4)
measure("one-ohm", Heater(polynomial(1.0, 3.9e-3), solid(6e-3)), up(2.0, 40), 10, ratio=1e-3)
