"""Chapter 8 of docs/bitstream.md, EP- and P-frames: transforms, prediction, mapping (8.1 to 8.3), codebooks and
residuals (8.4, 8.5), the coded bones (8.9) and the whole mesh. M-TFAN (8.7) is in mtfan.py, zippering (8.9) in
zipper.py."""
import math

from arithmetic import Decoder, Mixer, Model, Models, SignedModel, SymbolModel, UnsignedModel
from conventions import Bytes, L, add, check, clamp, sub
from intra import Mesh, decode_attributes
from mtfan import decode_mtfan
from reference import decode_point, decode_rotation, matrix
from stream import CODED_BONES, COLOUR, GEOMETRY, MAPPING, NORMALS, TEXCOORDS, TRANSFORMS
from zipper import zipper


# ---------------------------------------------------------------------------------------------- 8.1 to 8.3


def decode_transforms(data, bones):
    """(matrix, shift) a bone."""
    decoder = Decoder(data)
    still, rotation, shift = Model(), SignedModel(), SignedModel()
    out = []
    for _ in range(bones):
        if decoder.bit(still):
            out.append((matrix(0, [0, 0, 0]), (0, 0, 0)))
        else:
            M = decode_rotation(decoder, rotation)
            out.append((M, decode_point(decoder, shift)))
    decoder.check_end()
    return out


def predict_positions(reference, transforms):
    out = []
    for v, weights in zip(reference.mesh.positions, reference.weights):
        total = [0, 0, 0]
        for weight, bone in weights:
            M, shift = transforms[bone]
            pivot = reference.pivots[bone]
            moved, d = add(pivot, shift), sub(v, pivot)
            for i in range(3):
                turned = M[3 * i] * d[0] + M[3 * i + 1] * d[1] + M[3 * i + 2] * d[2]
                total[i] += weight * (turned + (moved[i] << 24))
        out.append(tuple(clamp((x + (1 << 35)) >> 36, -L, L) for x in total))
    return out


def turned_normal(reference, transforms, r):
    n, total = reference.mesh.normals[r], [0, 0, 0]
    for weight, bone in reference.weights[r]:
        M = transforms[bone][0]
        for i in range(3):
            total[i] += weight * (M[3 * i] * n[0] + M[3 * i + 1] * n[1] + M[3 * i + 2] * n[2])
    return tuple((x + (1 << 35)) >> 36 for x in total)


def area_classes(mesh):
    around, total = [0.0] * len(mesh.positions), 0.0
    for triangle in mesh.triangles:
        a, b, c = (mesh.positions[v] for v in triangle)
        (ux, uy, uz), (vx, vy, vz) = (tuple(map(float, sub(p, a))) for p in (b, c))
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area = math.sqrt(x * x + y * y + z * z)
        for v in triangle:
            around[v] += area
        total += area * 3
    mean = total / len(around) if around else 0.0
    limits = [limit * mean for limit in (0.25, 0.45, 0.62, 0.78, 0.92, 1.08, 1.3, 1.65, 2.4)]
    return [sum(limit <= area for limit in limits) for area in around]


def lower_neighbours(mesh):
    lower = [[] for _ in mesh.positions]
    for triangle in mesh.triangles:
        for i in range(3):
            v, u = triangle[i], triangle[(i + 1) % 3]
            if u < v and len(lower[v]) < 8:
                lower[v].append(u)
    return lower


def decode_mapping(data, reference, eligible, vertices):
    """ref[k], the reference vertex of each of the frame's vertices."""
    decoder = Decoder(data)
    area_class, lower = area_classes(reference), lower_neighbours(reference)
    model, mixer = Models(), Models(lambda: Mixer(4))
    last = before = before_that = 1
    left = vertices
    count = [0] * len(reference.positions)

    def decide(k, n, known, surplus):
        s = min(n, 5)
        contexts = [("runs", s, last, before, before_that), ("area", s, area_class[k], last),
                    ("neighbours", s, known, surplus), ("both", s, area_class[k], surplus)]
        return decoder.mixed(mixer[s], [model[context] for context in contexts])

    for k in eligible[:-1]:
        if left == 0:
            break
        known = min(len(lower[k]), 7)
        surplus = clamp(sum(min(count[u], 3) - 1 for u in lower[k]), -4, 4) + 4
        n = 0
        if decide(k, 0, known, surplus):
            n, left = 1, left - 1
            while left > 0 and not decide(k, n, known, surplus):
                n, left = n + 1, left - 1
        count[k] = n
        last, before, before_that = min(n, 3), last, min(before, 2)
        decoder.check_end()
    if eligible:
        count[eligible[-1]] += left
    else:
        check(left == 0, "it has vertices, but its bones no reference vertex")
    return [k for k, n in enumerate(count) for _ in range(n)]


# ---------------------------------------------------------------------------------------------- 8.4, 8.5 codebooks


class Codebook:
    pass


def read_codebook(payload):
    read = Bytes(payload)
    book = Codebook()
    book.purpose, book.number = read.field("B"), read.varint()
    check(book.purpose <= 1 and book.number < 1 << 31, "the codebook's purpose or number is out of range")
    decoder = Decoder(read.rest())
    step, length_model = UnsignedModel(), UnsignedModel()
    component = [SignedModel() for _ in range(3)]
    size = decoder.raw(12)
    book.escape_step = decoder.unsigned(step) + 1
    scale = decoder.unsigned(step) + 1
    check(book.escape_step <= 1 << 24 and scale <= 1 << 26, "the codebook's steps are out of range")
    book.codewords, book.lengths, length = [], [], 0
    for _ in range(size):
        codeword = tuple(decoder.signed(model) * scale for model in component)
        check(max(abs(x) for x in codeword) <= 1 << 26, "a codeword is out of range")
        length += decoder.unsigned(length_model)
        check(length <= 160, "a code length is out of range")
        decoder.check_end()
        book.codewords.append(codeword)
        book.lengths.append(length)
    book.lengths.append(decoder.raw(8))
    check(book.lengths[-1] <= 160, "a code length is out of range")
    decoder.check_end()
    return book


FRACTIONS = [1073741824, 984625594, 902905651, 827968132, 759250125, 696235434, 638450708, 585461881]


def weight_of(length):
    return max(1, FRACTIONS[length % 8] >> (length // 8))


def index_model(book):
    model = SymbolModel(len(book.lengths))
    leaves = 1 << model.bits
    mass = [0] * leaves + [weight_of(length) for length in book.lengths] + [0] * (leaves - len(book.lengths))
    for node in range(leaves - 1, 0, -1):
        mass[node] = mass[2 * node] + mass[2 * node + 1]
        if mass[node] > 0:
            model.node[node].one = clamp((mass[2 * node + 1] << 16) // mass[node], 48, 65487)
            model.node[node].seen = 24
    return model


def decode_residuals(data, count, book):
    decoder = Decoder(data)
    size = len(book.codewords)
    model, escape, out = index_model(book), [SignedModel() for _ in range(3)], []
    for _ in range(count):
        i = decoder.symbol(model)
        check(i <= size, "an index is outside the codebook")
        if i < size:
            out.append(book.codewords[i])
        else:
            value = tuple(decoder.signed(m) * book.escape_step for m in escape)
            check(max(abs(x) for x in value) <= 1 << 26, "a residual is out of range")
            out.append(value)
        decoder.check_end()
    return out


# ---------------------------------------------------------------------------------------------- 8.9, 8.10


def read_coded_bones(data, bones):
    check(len(data) == (bones + 7) // 8, "not one bit for every bone")
    return [data[i // 8] >> (i % 8) & 1 == 1 for i in range(bones)]


def animate(reference, transforms):
    base, mesh = reference.mesh, Mesh()
    mesh.positions = predict_positions(reference, transforms)
    mesh.triangles, mesh.colours, mesh.texcoords = base.triangles, base.colours, base.texcoords
    if base.normals:
        mesh.normals = [turned_normal(reference, transforms, v) for v in range(len(base.normals))]
    return mesh


def decode_predicted_mesh(frame, reference):
    base = reference.mesh
    check(frame.vertices == len(base.positions) and frame.triangles == len(base.triangles), "other counts")
    return animate(reference, decode_transforms(frame.layer(TRANSFORMS), len(reference.pivots)))


# ---------------------------------------------------------------------------------------------- 8. EP-frames


def decode_enhanced_mesh(frame, reference, books, m):
    base = reference.mesh
    check(base.positions, "the I-frame has no vertices")
    geometry_book, colour_book = books[0], books[1]
    check(geometry_book and geometry_book.number == frame.geometry_codebook, "the geometry codebook is not there")
    if base.colours:
        check(colour_book and colour_book.number == frame.colour_codebook, "the colour codebook is not there")
    transforms = decode_transforms(frame.layer(TRANSFORMS), len(reference.pivots))
    in_part = CODED_BONES in frame.layers
    eligible = list(range(len(base.positions)))
    if in_part:
        coded_bones = read_coded_bones(frame.layer(CODED_BONES), len(reference.pivots))
        eligible = [v for v in eligible if coded_bones[reference.bone[v]]]
    ref = decode_mapping(frame.layer(MAPPING), base, eligible, frame.vertices)
    predicted = predict_positions(reference, transforms)
    mesh = Mesh()
    for r, residual in zip(ref, decode_residuals(frame.layer(GEOMETRY), len(ref), geometry_book)):
        mesh.positions.append(tuple(clamp(x, -L, L) for x in add(predicted[r], residual)))
    if base.colours:
        residuals = decode_residuals(frame.layer(COLOUR), len(ref), colour_book)
        mesh.colours = [tuple(clamp(x, 0, 255) for x in add(base.colours[r], e)) for r, e in zip(ref, residuals)]
    if base.normals:
        given = [turned_normal(reference, transforms, r) for r in ref]
        mesh.normals = decode_attributes(frame.layer(NORMALS), 3, given=given)
    if base.texcoords:
        mesh.texcoords = decode_attributes(frame.layer(TEXCOORDS), 2, given=[base.texcoords[r] for r in ref])
    mesh.triangles = decode_mtfan(frame, mesh.positions, m)
    if in_part:
        still = [not coded_bones[bone] for bone in reference.bone]
        mesh = zipper(mesh, animate(reference, transforms), still)
    return mesh
