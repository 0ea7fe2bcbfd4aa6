#include "codec/tracked/vertex_field_walk.h"
#include "core/bytes.h"
#include "entropy/range_coder.h"

namespace htvm::internal {

namespace {

struct FieldReader {
    RangeDecoder decoder;
    bool bit(BinaryModel& model, bool) { return decoder.bit(model); }
    std::uint32_t raw(std::uint32_t, int n) { return decoder.raw(n); }
};

void read_field(FieldWalk& walk, FieldReader& reader) {
    for (auto& component : walk.components)
        if (component.step != 0) code_root(reader, component, walk.hierarchy.vertex_count, 0);
    for (std::size_t k = walk.hierarchy.levels.size(); k-- > 0;)
        for (std::size_t c = 0; c < walk.components.size(); ++c) {
            if (walk.components[c].step == 0) continue;
            walk.begin_level(k, c);
            const LevelMode mode = code_mode(reader, walk, walk.components[c].last, {});
            if (mode.coded) code_level(reader, walk, k, c, mode, [](auto, auto, auto, const auto&) { return 0; });
            walk.end_level(k, c, mode);
        }
}

}  // namespace

Result<DecodedField> decode_field(std::span<const std::uint8_t> bytes, const VertexHierarchy& hierarchy,
                                  std::size_t components, const FieldHistory* before) {
    if (components == 0 || components > most_field_components)
        return fail(ErrorKind::bad_input, "vertex field: there must be one to three components");
    ByteReader reader(bytes);
    FieldHeader header;
    const std::uint8_t flags = reader.u8();
    header.turned = flags & 1;
    header.has_history = flags & 2;
    bool valid = flags < 4 && (!header.turned || components == 3);
    for (std::size_t c = 0; c < components; ++c) {
        const std::uint64_t step = reader.varint();
        valid = valid && step <= most_step;
        header.step[c] = static_cast<std::uint32_t>(std::min<std::uint64_t>(step, most_step));
    }
    if (!reader.ok()) return fail(ErrorKind::corrupt_stream, "vertex field: the layer ends within its header");
    if (!valid) return fail(ErrorKind::corrupt_stream, "vertex field: the layer's header is not one of a field");
    if (header.has_history && !before)
        return fail(ErrorKind::corrupt_stream, "vertex field: the layer needs the frame before, which is missing");
    if (header.has_history && !history_fits(*before, hierarchy, components, header.turned))
        return fail(ErrorKind::bad_input, "vertex field: the frame before is of another mesh or another kind of field");
    FieldWalk walk(hierarchy, header, components, header.has_history ? before : nullptr);
    FieldReader coder{RangeDecoder(reader.bytes(reader.remaining()))};
    if (hierarchy.vertex_count > 0) read_field(walk, coder);
    if (coder.decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "vertex field: the layer ends too early");
    DecodedField out;
    out.history = history_of(walk, header.turned);
    out.values = field_values(out.history.planes, hierarchy.vertex_count, header.turned);
    return out;
}

}  // namespace htvm::internal
