"""Chapter 8.15 of docs/bitstream.md: fields, one or three smooth numbers a vertex, coded over the vertex hierarchy."""
import math

from arithmetic import Decoder, Mixer, Model, Models
from conventions import Bytes, check, clamp

M = 1 << 29


def three(x):
    return min(x, 2)


class Context:
    """All contexts of a rest except the level are 0 for the mean of all."""

    def __init__(self, level):
        self.level = level
        self.up = self.before = self.other = self.third = self.sign = self.activity = self.steep = self.slope = 0


class Component:
    """What is known about one component, and its models. mean[0] is by vertex, mean[k + 1] by node of level k, which
    size[k] is too."""

    def __init__(self, vertices, levels):
        self.mean = [[0] * vertices] + [[0] * len(level.count) for level in levels]
        self.size = [[0] * len(level.count) for level in levels]
        self.rest, self.above = [], [0]
        self.slope_weight, self.before_weight, self.coded = 4, 0, 1
        self.model, self.two, self.four = Models(), Models(lambda: Mixer(2)), Models(lambda: Mixer(4))

    def decode_rest(self, decoder, c):
        model, two = self.model, self.two
        if not decoder.mixed(self.four[c.level], [
                model["level", c.level, c.up, c.activity], model["before", c.before, c.activity],
                model["other", c.other, c.third, c.up, c.before], model["steep", c.steep, c.level]]):
            return 0
        negative = decoder.mixed(two["sign"], [model["slope", c.slope, c.steep], model["sign", c.sign, c.slope]])
        n = 0
        while n < 6 and decoder.mixed(two["more", n], [
                model["more by activity", c.activity, n], model["more by before", c.before, c.up, n]]):
            n += 1
        if n == 6:
            top = 0
            while top < 30 and decoder.bit(model["top", top]):
                top += 1
            value = 1
            if top > 0:
                value = 2 + decoder.bit(model["next", top])
            if top > 1:
                value = value << (top - 1) | decoder.raw(top - 1)
            n += value - 1
        magnitude = min(n, (1 << 30) - 1) + 1
        return -magnitude if negative else magnitude


class Field:
    """turned and components: what the next frame may be predicted from; values: by vertex, a list each."""

    def sums(self, levels, c, k):
        """slope_sum() of component c at each node of level k that has two children."""
        mean = self.components[c].mean[k + 1]
        return [0 if second is None else slope_sum(levels[k], mean, p) for p, second in enumerate(levels[k].second)]


class FieldBetween:
    """What stands for the field of the frame before in one between two others (8.18): the mean of theirs, mixed() of
    their numbers. earlier: None for the reference."""

    def __init__(self, earlier, later, mixed):
        self.earlier, self.later, self.mixed, self.turned = earlier, later, mixed, later.turned
        self.components = []
        for c, component in enumerate(later.components):
            before = earlier.components[c] if earlier else None
            between = Component(0, [])
            between.mean = [self.mix(before and before.mean[k], mean) for k, mean in enumerate(component.mean)]
            between.size = [self.mix(before and before.size[k], size) for k, size in enumerate(component.size)]
            self.components.append(between)

    def mix(self, earlier, later):
        return [self.mixed(earlier[i] if earlier else 0, x) for i, x in enumerate(later)]

    def sums(self, levels, c, k):
        return self.mix(self.earlier and self.earlier.sums(levels, c, k), self.later.sums(levels, c, k))


def slope_sum(level, mean, p):
    total = sum(slope * (mean[q] - mean[p]) for q, slope in level.slope[p].items())
    return clamp(total >> 12, -2 * M, 2 * M)


def predict(level, k, p, component, before, sums_before):
    total = component.slope_weight * slope_sum(level, component.mean[k + 1], p)
    if before and component.before_weight > 0:
        mean = before.mean[k]
        total += component.before_weight * (mean[level.first[p]] - mean[level.second[p]])
        weight = component.slope_weight * component.before_weight
        total -= (weight * sums_before[p]) >> 2
    return clamp((total + 2) >> 2, -2 * M, 2 * M)


def context_of(level, k, p, component, before, others, predicted, unit):
    """others: the rests of the components before, the nearest first."""
    c = Context(min(k, 5))
    size, above = component.size[k], component.above
    c.up = three(above[p])
    c.before = three(before.size[k][p]) if before else 0
    if others:
        c.other = three(abs(others[0][p]))
        c.sign = 0 if others[0][p] == 0 else 1 if others[0][p] > 0 else 2
    if len(others) > 1:
        c.third = three(abs(others[1][p]))
    x = sum(2 * min(size[q], 4) if q < p else min(above[q], 4) for q in level.around[p])
    c.activity = x if x < 8 else min(8 + (x - 8) // 6, 11)
    c.steep = min((8 * abs(predicted) // unit).bit_length(), 7)
    c.slope = 0 if c.steep == 0 else 1 if predicted > 0 else 2
    return c


def decode_level(decoder, level, k, component, step, before, sums_before, others, same, coded_models):
    component.coded = decoder.bit(coded_models[component.coded])
    if not decoder.bit(same):
        component.slope_weight = decoder.raw(3)
        if before:
            component.before_weight = min(decoder.raw(3), 4)
    mean, finer = component.mean[k + 1], component.mean[k]
    for p, (first, second) in enumerate(zip(level.first, level.second)):
        if second is None:
            finer[first] = mean[p]
            continue
        predicted = predict(level, k, p, component, before, sums_before)
        unit = max(1, (step * level.scale[p]) >> 14)
        if component.coded:
            c = context_of(level, k, p, component, before, others, predicted, unit)
            component.rest[p] = component.decode_rest(decoder, c)
            component.size[k][p] = min(abs(component.rest[p]), 255)
        d = clamp(predicted + component.rest[p] * unit, -2 * M, 2 * M)
        x = mean[p] + ((d * level.share[p] + (1 << 29)) >> 30)
        finer[first], finer[second] = clamp(x, -M, M), clamp(x - d, -M, M)


def values_of(components, turned):
    means = list(zip(*(component.mean[0] for component in components)))
    if not turned:
        return [tuple((mean + 128) >> 8 for mean in of_vertex) for of_vertex in means]
    out = []
    for x, y, z in means:
        a, b, s = 37837 * x, 46341 * y, 26755 * z
        out.append(tuple((sum_ + (1 << 23)) >> 24 for sum_ in (a + b - s, a + 2 * s, a - b - s)))
    return out


def decode_field_layer(data, vertices, levels, number, before):
    """As in versions 1 and 2. number: of components. before: the previous frame's field, or None."""
    read = Bytes(data)
    flags = read.field("B")
    steps = [read.varint() for _ in range(number)]
    check(flags < 4 and max(steps) <= 1 << 28, "a field's header is out of range")
    turned = flags & 1 != 0
    check(number == 3 or not turned, "a field of one component is turned")
    if flags & 2:
        check(before and before.turned == turned, "a field needs one of the previous frame")
    else:
        before = None
    return decode_field(Decoder(read.rest()), turned, steps, vertices, levels, before)


def decode_field(decoder, turned, steps, vertices, levels, before):
    """steps: one per component. before: the field that predicts it, or None."""
    number = len(steps)
    field = Field()
    field.turned = turned
    field.components = components = [Component(vertices, levels) for _ in range(number)]
    befores = before.components if before else [None] * number
    same, coded_models = Model(), Models()
    root = math.sqrt(max(vertices, 1))
    if vertices > 0:
        for component, step, old in zip(components, steps, befores):
            component.before_weight = 4 if before else 0
            if step > 0:
                rest = component.decode_rest(decoder, Context(5))
                mean = (old.mean[-1][0] if before else 0) + rest * max(1, int(step / root))
                component.mean[-1][0] = clamp(mean, -M, M)
    for k in range(len(levels) - 1, -1, -1):
        level = levels[k]
        for component in components:
            component.rest = [0] * len(level.count)
        for c, component in enumerate(components):
            if steps[c] > 0:
                others = [other.rest for other in reversed(components[:c])]
                sums = before.sums(levels, c, k) if before else None
                decode_level(decoder, level, k, component, steps[c], befores[c], sums, others, same, coded_models)
        if k > 0:
            for component in components:
                above, component.above = component.above, [0] * len(levels[k - 1].count)
                for p, (first, second) in enumerate(zip(level.first, level.second)):
                    component.above[first] = above[p] if second is None else component.size[k][p]
                    if second is not None:
                        component.above[second] = component.size[k][p]
    decoder.check_end()
    field.values = values_of(components, field.turned)
    return field
