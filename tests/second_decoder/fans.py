"""Section 6.2 of docs/bitstream.md, triangle fans: the decoder that TFAN (I-frames) shares with M-TFAN
(section 8.7, mtfan.py)."""
from arithmetic import Decoder, Mixer, Models, UnsignedModel
from conventions import check


class OpenEdges:
    """The open half-edges (from, to, apex), and how many corners each vertex has."""

    def __init__(self):
        self.corners, self.out, self.into = [], [], []

    def add_vertex(self):
        self.corners.append(0)
        self.out.append([])
        self.into.append([])

    def add_triangle(self, a, b, c):
        for v in (a, b, c):
            self.corners[v] += 1
        for half_edge in ((a, b, c), (b, c, a), (c, a, b)):
            self.add_half_edge(half_edge)

    def add_half_edge(self, half_edge):
        start, end, _ = half_edge
        if start == end:
            return
        opposite = self.find(end, start)
        if opposite is None:
            half_edge = list(half_edge)  # its own object: equal half-edges are not the same one
            self.out[start].insert(0, half_edge)
            self.into[end].insert(0, half_edge)
        else:
            for edges in (self.out[opposite[0]], self.into[opposite[1]]):
                del edges[next(i for i, edge in enumerate(edges) if edge is opposite)]

    def find(self, start, end):
        for out, into in list(zip(self.out[start], self.into[end]))[:32]:
            if out[1] == end:
                return out
            if into[0] == start:
                return into
        return None


class Fan:
    def __init__(self, focus):
        self.focus = focus
        self.start = self.previous = self.current = self.behind = self.beyond_end = None
        self.left = self.right = None
        self.length, self.last, self.from_candidate, self.fills_hole, self.ends = 0, "none", False, False, []

    def end(self):
        return self.ends[0] if self.ends else None


class FanDecoder:
    """Decodes triangles in visiting numbers. `discovery` says what differs between TFAN and M-TFAN: seed() and
    discover(fan) visit a vertex, hints(fan) gives three classes."""

    def __init__(self, data, triangle_count, discovery, seed_implies_fan):
        self.decoder = Decoder(data)
        self.triangle_count, self.discovery, self.seed_implies_fan = triangle_count, discovery, seed_implies_fan
        self.edges = OpenEdges()
        self.triangles = []
        self.model = Models()  # by name and contexts
        self.mixer = Models(lambda: Mixer(5))
        self.far, self.walk_steps = UnsignedModel(), UnsignedModel()

    def visited(self):
        return len(self.edges.corners)

    def complete(self):
        return len(self.triangles) >= self.triangle_count

    def decode(self):
        focus = 0
        while not self.complete():
            implied = False
            if focus == self.visited():
                self.discovery.seed()
                self.edges.add_vertex()
                implied = self.seed_implies_fan
            while not self.complete() and (implied or self.more_fans(focus)):
                implied = False
                self.decode_fan(focus)
            focus += 1
        self.decoder.check_end()
        return self.triangles

    def more_fans(self, focus):
        edges = self.edges
        context = (min(edges.corners[focus], 15), min(len(edges.into[focus]), 2), min(len(edges.out[focus]), 2))
        self.decoder.check_end()
        return self.decoder.bit(self.model[("more_fans",) + context])

    def new_vertex(self, fan):
        self.discovery.discover(fan)
        self.edges.add_vertex()
        return self.visited() - 1

    def decode_fan(self, focus):
        fan = Fan(focus)
        self.code_start(fan)
        if fan.start is None:
            fan.start = self.new_vertex(fan)
        check(fan.start < self.visited(), "a fan starts at a vertex that was not visited")
        fan.current = fan.start
        self.find_ends(fan)
        while not self.complete():
            self.look_around(fan)
            step, vertex = self.code_step(fan)
            if step == "stop":
                return
            if step == "new":
                vertex = self.new_vertex(fan)
            check(vertex is not None and vertex < self.visited(), "a fan goes to a vertex that was not visited")
            self.decoder.check_end()
            self.triangles.append((focus, fan.current, vertex))
            self.edges.add_triangle(focus, fan.current, vertex)
            fan.previous = fan.behind = fan.current
            fan.current, fan.last = vertex, step
            fan.length += 1
            if step == "close":
                return

    def code_start(self, fan):
        candidates = self.edges.into[fan.focus][:4]
        n = len(candidates)
        fan.from_candidate = n > 0 and self.decoder.bit(self.model["starts_at_candidate", n - 1]) == 1
        if fan.from_candidate:
            fan.start, _, fan.behind = candidates[self.index("start_index", n)]
        elif self.decoder.bit(self.model["starts_at_known"]):
            fan.start = (fan.focus + self.decoder.unsigned(self.far)) & 0xFFFFFFFF

    def index(self, name, n):
        i = 0
        while i + 1 < n and self.decoder.bit(self.model[name, i]):
            i += 1
        return i

    def find_ends(self, fan):
        edges = self.edges
        for _, to, _ in edges.out[fan.focus][:8]:
            if len(fan.ends) == 3:
                break
            if to != fan.start:
                fan.ends.append(to)
        if len(fan.ends) > 1 and fan.from_candidate:
            v = fan.start
            for _ in range(31):
                if v != fan.start and v in fan.ends:
                    k = fan.ends.index(v)
                    fan.ends[0], fan.ends[k] = fan.ends[k], fan.ends[0]
                    break
                if not edges.into[v]:
                    break
                v = edges.into[v][0][0]
        if fan.ends:
            fan.beyond_end = next(apex for _, to, apex in edges.out[fan.focus] if to == fan.ends[0])
        if not fan.from_candidate:
            fan.ends.append(fan.start)

    def before(self, v, *avoid):
        return next((edge[0] for edge in self.edges.into[v][:4] if edge[0] not in avoid), None)

    def after(self, v, avoid):
        return next((edge[1] for edge in self.edges.out[v][:4] if edge[1] != avoid), None)

    def look_around(self, fan):
        end = fan.end()
        fan.left = None if fan.last == "new" else self.before(fan.current, fan.focus, fan.previous)
        fan.right = None if end is None or end == fan.start else self.after(end, fan.focus)
        fan.fills_hole = end is not None and (fan.left == end or fan.right == fan.current)
        if fan.left == end:
            fan.left = None
        if fan.right == fan.current or fan.right == fan.left:
            fan.right = None

    def code_step(self, fan):
        def count(v, most=7):
            return 0 if v is None else min(self.edges.corners[v], most)

        gap, hint_left, hint_right = self.discovery.hints(fan)
        if not fan.ends:
            situation = 0
        elif fan.fills_hole:
            situation = 1
        else:
            situation = {"new": 2, "none": 3}.get(fan.last, 4)
        ways = (fan.left is not None) + 2 * (fan.right is not None)
        turned = fan.last in ("left", "right")
        focus, current, end = count(fan.focus, 15), count(fan.current), count(fan.end())
        left, right, behind, beyond = count(fan.left), count(fan.right), count(fan.behind), count(fan.beyond_end)
        # A tuple of contexts names a model here where the document computes an index: the same models.
        if self.mixed("new", (situation, min(fan.length, 7)), [
            (focus, end, situation, gap),
            (focus, current, situation, gap),
            (gap, hint_left, hint_right, situation),
            (focus, end, right),
            (focus, behind, beyond, situation),
        ]):
            return "new", None
        if fan.ends and self.mixed("closing", (situation, ways), [
            (focus, situation, ways, turned),
            (focus, current, end),
            (focus, end, situation, gap),
            (left, current, end, right),
            (gap, hint_left, hint_right, situation),
        ]):
            return "close", fan.ends[self.index("end_index", len(fan.ends))]
        bit = self.decoder.bit
        if fan.left is not None and bit(self.model["goes_left", ways, current, hint_left]):
            return "left", fan.left
        if fan.right is not None and bit(self.model["goes_right", end, hint_right]):
            return "right", fan.right
        if fan.length > 0 and bit(self.model["stops", min(len(fan.ends), 3)]):
            return "stop", None
        return "known", self.known_vertex(fan)

    def mixed(self, name, mixer_context, contexts):
        models = [self.model[(name, i) + context] for i, context in enumerate(contexts)]
        return self.decoder.mixed(self.mixer[(name,) + mixer_context], models)

    def known_vertex(self, fan):
        if self.decoder.bit(self.model["walks", len(fan.ends) > 0]):
            leftward = self.decoder.bit(self.model["walks_left"])
            steps = min((self.decoder.unsigned(self.walk_steps) + 1) & 0xFFFFFFFF, 31)
            v = fan.current if leftward else fan.end()
            for _ in range(steps):
                if v is None:
                    break
                v = self.before(v, fan.focus, fan.previous) if leftward else self.after(v, fan.focus)
            return v
        return (fan.focus + self.decoder.unsigned(self.far)) & 0xFFFFFFFF


class NumberInTurn:
    """TFAN: a visited vertex takes the next number."""

    def __init__(self, vertices):
        self.left = vertices

    def seed(self):
        check(self.left > 0, "there are more vertices than the header says")
        self.left -= 1

    def discover(self, fan):
        self.seed()

    def hints(self, fan):
        return 0, 0, 0
