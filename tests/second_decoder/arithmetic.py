"""Chapter 5 of docs/bitstream.md, entropy coding: the models, the arithmetic decoder and what is
decoded with it."""
from conventions import check, clamp


class Model:
    """A binary model (5.2)."""

    __slots__ = ("one", "seen")

    def __init__(self, one=32768, seen=0):
        self.one, self.seen = one, seen

    def update(self, bit):
        target = 65535 if bit else 0
        rate = 131072 // (2 * self.seen + 3)
        self.one = clamp(self.one + (((target - self.one) * rate) >> 16), 48, 65487)
        self.seen = min(self.seen + 1, 127)


class Models:
    """Any number of models, each created when first used."""

    def __init__(self, kind=Model):
        self.kind, self.made = kind, {}

    def __getitem__(self, key):
        if key not in self.made:
            self.made[key] = self.kind()
        return self.made[key]


class UnsignedModel:
    def __init__(self):
        self.prefix, self.mantissa = Models(), Models()


class SignedModel:
    def __init__(self):
        self.zero, self.negative, self.magnitude = Model(), Model(), UnsignedModel()


class SymbolModel:
    def __init__(self, size):
        self.bits = (size - 1).bit_length()
        self.node = [Model() for _ in range(1 << self.bits)]


class ResidualContext:
    def __init__(self):
        self.zero, self.negative, self.top = Model(), Model(), Models()


class ResidualMantissa:
    def __init__(self):
        self.node = Models()


KNOTS = [22, 36, 60, 98, 162, 267, 439, 720, 1179, 1921, 3108, 4971, 7812, 11955, 17625, 24743, 32768, 40793, 47911,
         53581, 57724, 60565, 62428, 63615, 64357, 64816, 65097, 65269, 65374, 65438, 65476, 65500, 65514]


def probability(log_odds):
    x = clamp(log_odds, -2047, 2047) + 2048
    knot, part = x >> 7, x & 127
    return (KNOTS[knot] * (128 - part) + KNOTS[knot + 1] * part) >> 7


def make_log_odds():
    table, x = [], -2047
    for p in range(4096):
        while x < 2047 and probability(x) < 16 * p + 8:
            x += 1
        table.append(x)
    return table


LOG_ODDS = make_log_odds()


class Mixer:
    def __init__(self, votes):
        self.weights = [65536 * 5 // (4 * votes)] * votes


class Decoder:
    """The arithmetic decoder (5.1) and what is decoded with it."""

    def __init__(self, data):
        self.data, self.at, self.past_end = data, 0, 0
        self.range, self.code = (1 << 32) - 1, 0
        for _ in range(4):
            self.code = self.code << 8 | self.next_byte()

    def next_byte(self):
        if self.at < len(self.data):
            self.at += 1
            return self.data[self.at - 1]
        self.past_end += 1
        return 0

    def end_at(self, size):
        check(self.at <= size, "a run ends within what was read of it")
        self.data = self.data[:size]

    def check_end(self):
        check(self.past_end <= 4, "a layer ends too early")

    def normalise(self):
        while self.range < 1 << 24:
            self.range <<= 8
            self.code = (self.code << 8 | self.next_byte()) & 0xFFFFFFFF

    def decide(self, one):
        """A decision with a given probability; nothing adapts."""
        bound = (self.range >> 16) * one
        bit = self.code < bound
        if bit:
            self.range = bound
        else:
            self.code -= bound
            self.range -= bound
        self.normalise()
        return int(bit)

    def bit(self, model):
        bit = self.decide(model.one)
        model.update(bit)
        return bit

    def raw(self, n):
        value = 0
        while n > 0:
            now = min(n, 16)
            n -= now
            self.range >>= now
            part = min(self.code // self.range, (1 << now) - 1)
            self.code -= part * self.range
            value = value << now | part
            self.normalise()
        return value

    def symbol(self, model):
        node = 1
        for _ in range(model.bits):
            node = 2 * node + self.bit(model.node[node])
        return node - (1 << model.bits)

    def unsigned(self, model):
        k = 0
        while k < 32 and self.bit(model.prefix[k]):
            k += 1
        value = node = 1
        left = k
        while left > 0 and left > k - 3:
            bit = self.bit(model.mantissa[k, node])
            node, value, left = 2 * node + bit, 2 * value + bit, left - 1
        if left > 0:
            value = value << left | self.raw(left)
        return (value - 1) & 0xFFFFFFFF

    def signed(self, model):
        if self.bit(model.zero):
            return 0
        negative = self.bit(model.negative)
        magnitude = min((self.unsigned(model.magnitude) & 0x7FFFFFFF) + 1, 0x7FFFFFFF)
        return -magnitude if negative else magnitude

    def bit2(self, a, b):
        bit = self.decide((a.one + b.one) // 2)
        a.update(bit)
        b.update(bit)
        return bit

    def residual(self, a, b, mantissa):
        if self.bit2(a.zero, b.zero):
            return 0
        negative = self.bit2(a.negative, b.negative)
        top = 0
        while top < 29 and self.bit2(a.top[top], b.top[top]):
            top += 1
        magnitude = node = 1
        left = top
        while left > 0 and left > top - 2:
            bit = self.bit(mantissa.node[top, node])
            node, magnitude, left = 2 * node + bit, 2 * magnitude + bit, left - 1
        if left > 0:
            magnitude = magnitude << left | self.raw(left)
        return -magnitude if negative else magnitude

    def mixed(self, mixer, models):
        votes = [LOG_ODDS[model.one >> 4] for model in models]
        total = sum(vote * weight for vote, weight in zip(votes, mixer.weights))
        p = probability(clamp(total >> 16, -2047, 2047))
        bit = self.decide(clamp(p, 48, 65487))
        error = (65536 if bit else 0) - p
        for i, vote in enumerate(votes):
            change = (vote * error * 5) >> 18
            mixer.weights[i] = clamp(mixer.weights[i] + change, -(1 << 20), 1 << 20)
            models[i].update(bit)
        return bit
