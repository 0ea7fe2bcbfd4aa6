// The decoder's C interface: any calls in any order on a handle, with arrays of exactly the capacity that is given. The
// input: a number of calls, three bytes each, then a stream, sent in pieces or packets as the calls say.
#include <cstring>
#include <memory>

#include "htvm/htvm.h"
#include "whole_decoder.h"

namespace {

using namespace htvm;
using fuzz::require;

struct Caller {
    htvm_decoder* decoder = nullptr;
    std::vector<std::uint8_t> stream;
    std::vector<Packet> packets;
    std::size_t sent_bytes = 0, sent_packets = 0;
    htvm_frame_info current{};
    bool any_current = false;
};

// The status must be one that the header lists for the call, with a message if it is a failure.
htvm_status expect(const Caller& caller, htvm_status status) {
    require(status >= HTVM_BUFFER_TOO_SMALL && status <= HTVM_END,
            "a status of the header, and never an internal fault");
    if (status < 0)
        require(std::strlen(htvm_decoder_last_error(caller.decoder)) > 0, "a call that failed says what was wrong");
    return status;
}

// A copy into an array of `capacity` elements: must succeed if that is enough, and be refused if not.
template <class Element, class Function>
void copy(Caller& caller, Function function, std::size_t capacity, std::size_t needed, bool has) {
    const auto array = std::make_unique<Element[]>(capacity);
    const auto status = expect(caller, function(caller.decoder, array.get(), capacity));
    if (!caller.any_current || !has)
        require(status == HTVM_BAD_INPUT, "without a frame or the attribute there is nothing to copy");
    else
        require(status == (capacity < needed ? HTVM_BUFFER_TOO_SMALL : HTVM_OK), "copies need the room that is said");
}

void copy_something(Caller& caller, std::uint8_t which, std::uint8_t room) {
    const auto& info = caller.current;
    const auto capacity = [&](std::size_t needed) { return room < 64 && needed > 0 ? needed - 1 : needed + room % 2; };
    const std::size_t vertices = info.vertices;
    switch (which % 7) {
        case 0:
            return copy<float>(caller, htvm_decoder_copy_positions, capacity(3 * vertices), 3 * vertices, true);
        case 1:
            return copy<std::uint32_t>(caller, htvm_decoder_copy_triangles, capacity(3 * std::size_t{info.triangles}),
                                       3 * std::size_t{info.triangles}, true);
        case 2:
            return copy<std::uint8_t>(caller, htvm_decoder_copy_colours, capacity(3 * vertices), 3 * vertices,
                                      vertices == 0 || (info.attributes & HTVM_COLOURS));
        case 3:
            return copy<float>(caller, htvm_decoder_copy_normals, capacity(3 * vertices), 3 * vertices,
                               vertices == 0 || (info.attributes & HTVM_NORMALS));
        case 4:
            return copy<float>(caller, htvm_decoder_copy_texcoords, capacity(2 * vertices), 2 * vertices,
                               vertices == 0 || (info.attributes & HTVM_TEXCOORDS));
        case 5:
            return copy<double>(caller, htvm_decoder_copy_joints, capacity(3 * std::size_t{info.joints}),
                                3 * std::size_t{info.joints}, true);
        default:
            return copy<double>(caller, htvm_decoder_copy_orientations, capacity(9 * std::size_t{info.bones}),
                                9 * std::size_t{info.bones}, true);
    }
}

// Everything on loan can be read to its end.
void view_everything(Caller& caller) {
    htvm_mesh_view view{};
    const auto status = expect(caller, htvm_decoder_view(caller.decoder, &view, sizeof view));
    require(status == (caller.any_current ? HTVM_OK : HTVM_BAD_INPUT), "a current frame can be seen");
    if (status != HTVM_OK) return;
    require(view.vertices == caller.current.vertices && view.triangles == caller.current.triangles &&
                view.topology == caller.current.topology,
            "a view is of the current frame");
    for (std::size_t i = 0; i < 3 * std::size_t{view.triangles}; ++i)
        require(view.indices[i] < view.vertices, "triangles name vertices that are there");
    std::size_t sum = 0;
    const auto read = [&](const auto* numbers, std::size_t count) {
        for (std::size_t i = 0; numbers && i < count; ++i) sum += numbers[i] != 0;
    };
    read(view.positions, 3 * std::size_t{view.vertices});
    read(view.colours, 3 * std::size_t{view.vertices});
    read(view.normals, 3 * std::size_t{view.vertices});
    read(view.texcoords, 2 * std::size_t{view.vertices});
    require(sum <= 11 * std::size_t{view.vertices}, "no more numbers than there are");
}

// Notes that a frame became current, or that none did.
void made_current(Caller& caller, htvm_status status) {
    expect(caller, status);
    caller.any_current = status == HTVM_OK;
    if (caller.any_current) require(caller.current.vertices <= 1u << 16, "no more than allowed");
}

void send(Caller& caller, bool as_bytes, std::uint8_t size) {
    if (as_bytes) {
        const std::size_t piece =
            std::min<std::size_t>(std::size_t{size} * 8, caller.stream.size() - caller.sent_bytes);
        // A separate copy, so that reading past its end is detected.
        const std::vector<std::uint8_t> bytes(
            caller.stream.begin() + static_cast<std::ptrdiff_t>(caller.sent_bytes),
            caller.stream.begin() + static_cast<std::ptrdiff_t>(caller.sent_bytes + piece));
        if (expect(caller, htvm_decoder_send_bytes(caller.decoder, bytes.data(), bytes.size())) == HTVM_OK)
            caller.sent_bytes += piece;
    } else if (!caller.packets.empty()) {
        auto bytes = write_packet(caller.packets[caller.sent_packets % caller.packets.size()]);
        if (size == 255) bytes.pop_back();
        const auto status = expect(caller, htvm_decoder_send_packet(caller.decoder, bytes.data(), bytes.size()));
        if (status == HTVM_OK) ++caller.sent_packets;
    }
}

void ask(Caller& caller, std::uint8_t a, std::uint8_t b) {
    htvm_sequence_info sequence{};
    expect(caller, htvm_decoder_sequence(caller.decoder, &sequence, a % 2 ? sizeof sequence : b));
    const std::size_t capacity = b;
    const auto name = std::make_unique<char[]>(capacity);
    if (expect(caller, htvm_decoder_joint_name(caller.decoder, a, name.get(), capacity)) == HTVM_OK)
        require(std::strlen(name.get()) < capacity, "names end with a 0");
    std::uint32_t first = 0, second = 0;
    double radius = 0;
    if (expect(caller, htvm_decoder_bone(caller.decoder, a, &first, &second, &radius)) == HTVM_OK && a % 2)
        require(first < sequence.joints && second < sequence.joints, "bones join joints that are there");
    std::uint64_t damaged = 0, pending = 0;
    require(htvm_decoder_unused_bytes(caller.decoder, &damaged, &pending) == HTVM_OK, "it can always be asked");
    require(damaged + pending <= caller.sent_bytes, "no more is unused than was sent");
}

void call(Caller& caller, std::uint8_t kind, std::uint8_t a, std::uint8_t b) {
    auto* decoder = caller.decoder;
    auto& info = caller.current;
    switch (kind % 8) {
        case 0:
            return send(caller, a < 200, b);
        case 1:
        case 2:
            return made_current(caller, htvm_decoder_receive_frame(decoder, &info, sizeof info));
        case 3:
        case 4:
            view_everything(caller);
            return copy_something(caller, a, b);
        case 5:
            return ask(caller, a, b);
        case 6:
            return made_current(caller, htvm_decoder_conceal(decoder, a, b, &info, sizeof info));
        default:
            if (a < 32) require(htvm_decoder_discard(decoder) == HTVM_OK, "it can always be told to forget");
            return send(caller, true, b);
    }
}

// Whatever was called before, the rest can be received, and it ends.
void drain(Caller& caller) {
    const std::size_t packets = caller.stream.size() / packet_overhead + caller.sent_packets + 1;
    std::size_t received = 0;
    while (expect(caller, htvm_decoder_receive_frame(caller.decoder, nullptr, 0)) != HTVM_AGAIN)
        require(++received <= packets, "no more frames and failures than packets");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const auto calls = input.take(std::size_t{input.below(64)} * 3);
    htvm_decoder_options options;
    require(htvm_decoder_options_init(&options, sizeof options) == HTVM_OK, "options are given their defaults");
    options.threads = 1;
    options.max_vertices = 1 << 16;
    options.max_triangles = 1 << 17;
    Caller caller;
    const auto rest = input.rest();
    caller.stream.assign(rest.begin(), rest.end());
    fuzz::repair_checksums(caller.stream);
    caller.packets = fuzz::read_packets(caller.stream, caller.stream.size() + 1);
    require(htvm_decoder_create(&options, &caller.decoder) == HTVM_OK, "a decoder can be made");
    for (std::size_t i = 0; i + 3 <= calls.size(); i += 3) call(caller, calls[i], calls[i + 1], calls[i + 2]);
    drain(caller);
    htvm_decoder_destroy(caller.decoder);
    return 0;
}
