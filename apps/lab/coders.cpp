#include "coders.h"

#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string_view>

#include "htvm/decoder.hpp"
#include "htvm/option_list.hpp"
#include "io/mesh_file.h"
#include "metrics/recoded_area.h"
#include "tfan_mpeg.h"

namespace htvm::lab {

// ---- Our codec ------------------------------------------------------------------------------------------------------

namespace {

struct Codec {
    Encoder encoder;
    Decoder decoder;
    unsigned threads = 1;
};

// All packets of the frame just pushed. Bytes that do not belong to the frame itself (the sequence header, sent with
// the first one) count as overhead.
Result<CodedFrame> decode_pending(Codec& codec) {
    CodedFrame out;
    out.decode_ms = 0;
    out.type = codec.encoder.last_frame().type;
    out.bytes = codec.encoder.last_frame().bytes;
    std::size_t sent = 0;
    while (auto packet = codec.encoder.pull()) {
        sent += packet->payload.size() + packet_overhead;
        const Stopwatch watch(codec.threads);
        auto frame = codec.decoder.decode_copy(*packet);
        *out.decode_ms += watch.milliseconds();
        if (!frame) return tl::unexpected(frame.error());
        if (!*frame) continue;
        out.decoded = std::move((*frame)->mesh);
        const auto told = inspect(*packet);
        if (!told) return tl::unexpected(told.error());
        out.recoded = recoded_share(view_of(out.decoded), *told);
    }
    out.bytes.overhead += sent - out.bytes.total();
    return out;
}

Result<FrameCoder> start_codec(EncoderOptions options, const SequenceFacts& facts, const QualityPoint& quality) {
    options.geometry_step = quality.geometry_step;
    options.colour_step = quality.colour_step;
    options.threads = quality.threads;
    options.fps_numerator = static_cast<std::uint32_t>(std::lround(facts.fps * 1000));
    options.fps_denominator = 1000;
    options.skeleton = facts.skeleton;
    options.radii = facts.radii;
    auto encoder = Encoder::create(options);
    if (!encoder) return tl::unexpected(encoder.error());
    DecoderOptions decoder_options;
    decoder_options.threads = quality.threads;
    auto codec = std::make_shared<Codec>(Codec{std::move(*encoder), Decoder(decoder_options), quality.threads});
    return FrameCoder([codec](const SourceFrame& frame) -> Result<CodedFrame> {
        const Stopwatch watch(codec->threads);
        const auto pushed = codec->encoder.push(frame.mesh, frame.pose ? &*frame.pose : nullptr, frame.timestamp_us);
        const double encode_ms = watch.milliseconds();
        if (!pushed) return tl::unexpected(pushed.error());
        auto coded = decode_pending(*codec);
        if (coded) coded->encode_ms = encode_ms;
        return coded;
    });
}

// Every option that has an effect in the profile, except those that the sweep sets.
std::string settings_of(const EncoderOptions& options) {
    constexpr std::array<std::string_view, 7> by_the_sweep = {
        "quality", "geometry_step", "colour_step", "threads", "fps_numerator", "fps_denominator", "unit_micrometres"};
    std::string out = profile_name(options.profile);
    for (const auto& option : option_list())
        if (serves(option.group, options.profile) &&
            std::find(by_the_sweep.begin(), by_the_sweep.end(), option.name) == by_the_sweep.end())
            out += fmt::format(", {} {}", option.name, value_text(option, option.get(options)));
    return out;
}

}  // namespace

QualityPoint quality_point(double quality) {
    const auto steps = quality_steps(quality);
    QualityPoint out;
    out.quality = quality;
    out.geometry_step = steps.geometry_step;
    out.colour_step = std::round(steps.colour_step);  // like the encoder
    return out;
}

CoderUnderTest codec_under_test(const std::string& name, const std::string& description,
                                const EncoderOptions& options) {
    CoderUnderTest out;
    out.name = name;
    out.description = description;
    out.settings = settings_of(options);
    out.start = [options](const SequenceFacts& facts, const QualityPoint& quality) {
        return start_codec(options, facts, quality);
    };
    return out;
}

EncoderOptions paper_options(int key_interval) {
    EncoderOptions out = default_options(Profile::paper);
    if (key_interval > 0) out.key_interval = key_interval;
    return out;
}

std::vector<CoderUnderTest> built_in_coders(int key_interval, Denoising denoise) {
    EncoderOptions ours = default_options(Profile::topology);
    if (key_interval > 0) ours.key_interval = key_interval;
    EncoderOptions motion = ours;
    motion.topology.still_below = default_still_below;
    EncoderOptions chosen = ours;
    chosen.topology.frame_choice = FrameChoice::rate_distortion;
    EncoderOptions tracked = default_options(Profile::tracked);
    if (key_interval > 0) tracked.key_interval = key_interval;
    tracked.tracked.denoise = denoise;
    EncoderOptions intra = ours;
    intra.key_interval = 1;
    return {
        codec_under_test("paper",
                         "I- and EP-frames with the paper's choices: reference vertices by bone, point to point",
                         paper_options(key_interval)),
        codec_under_test(
            "htvm-ep",
            "I- and EP-frames as in htvm encode --profile topology: reference vertices anywhere, point to plane", ours),
        codec_under_test("htvm-motion",
                         "htvm-ep with motion-based coding: what fits the capture is animated, not coded", motion),
        codec_under_test("htvm-rd", "I-, EP- and P-frames chosen by measured bits and errors; slow", chosen),
        codec_under_test("htvm-t", "I- and T-frames, as htvm encode makes them: a mesh laid on each frame's surface",
                         tracked),
        codec_under_test("tfan", "our TFAN alone: every frame an I-frame", intra),
        mpeg_tfan_under_test("tfan-mpeg"),
        draco_under_test("draco10", 10),
        draco_under_test("draco7", 7)};
}

// ---- Draco ----------------------------------------------------------------------------------------------------------

namespace {

using draco::GeometryAttribute;

struct DracoSettings {
    int speed = 0;  // 10 - compression level
    int position_bits = 11;
    int colour_step = 1;
};

template <class Value>
void add_attribute(draco::PointCloud& cloud, GeometryAttribute::Type type, draco::DataType data_type,
                   const std::vector<Value>& values) {
    GeometryAttribute attribute;
    attribute.Init(type, nullptr, 3, data_type, false, sizeof(Value), 0);
    const int id = cloud.AddAttribute(attribute, true, static_cast<std::uint32_t>(values.size()));
    for (std::uint32_t i = 0; i < values.size(); ++i)
        cloud.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &values[i]);
}

void fill(draco::PointCloud& cloud, const Mesh& mesh, bool colours, int colour_step) {
    cloud.set_num_points(static_cast<std::uint32_t>(mesh.positions.size()));
    add_attribute(cloud, GeometryAttribute::POSITION, draco::DT_FLOAT32, mesh.positions);
    if (!colours) return;
    auto numbered = mesh.colours;
    for (auto& colour : numbered)
        for (auto& c : colour) c = static_cast<std::uint8_t>((c + colour_step / 2) / colour_step);
    add_attribute(cloud, GeometryAttribute::COLOR, draco::DT_UINT8, numbered);
}

Result<std::vector<char>> encode(const Mesh& mesh, const DracoSettings& settings, bool colours, double& milliseconds) {
    draco::Encoder encoder;
    encoder.SetSpeedOptions(settings.speed, settings.speed);
    encoder.SetAttributeQuantization(GeometryAttribute::POSITION, settings.position_bits);
    draco::EncoderBuffer buffer;
    draco::Status status;
    if (mesh.triangles.empty()) {
        draco::PointCloud cloud;
        fill(cloud, mesh, colours, settings.colour_step);
        const Stopwatch watch(1);
        status = encoder.EncodePointCloudToBuffer(cloud, &buffer);
        milliseconds = watch.milliseconds();
    } else {
        draco::Mesh packed;
        fill(packed, mesh, colours, settings.colour_step);
        for (const auto& t : mesh.triangles)
            packed.AddFace({draco::PointIndex(t[0]), draco::PointIndex(t[1]), draco::PointIndex(t[2])});
        packed.DeduplicateAttributeValues();
        packed.DeduplicatePointIds();
        const Stopwatch watch(1);
        status = encoder.EncodeMeshToBuffer(packed, &buffer);
        milliseconds = watch.milliseconds();
    }
    if (!status.ok())
        return fail(ErrorKind::unsupported, std::string("Draco cannot code this mesh: ") + status.error_msg());
    return std::vector<char>(buffer.data(), buffer.data() + buffer.size());
}

void read_vertices(const draco::PointCloud& cloud, int colour_step, Mesh& mesh) {
    const auto* positions = cloud.GetNamedAttribute(GeometryAttribute::POSITION);
    const auto* colours = cloud.GetNamedAttribute(GeometryAttribute::COLOR);
    mesh.positions.resize(cloud.num_points());
    if (colours) mesh.colours.resize(cloud.num_points());
    for (std::uint32_t i = 0; i < cloud.num_points(); ++i) {
        positions->GetMappedValue(draco::PointIndex(i), &mesh.positions[i]);
        if (!colours) continue;
        colours->GetMappedValue(draco::PointIndex(i), &mesh.colours[i]);
        for (auto& c : mesh.colours[i]) c = static_cast<std::uint8_t>(std::min(c * colour_step, 255));
    }
}

Result<Mesh> decode(const std::vector<char>& bytes, const DracoSettings& settings, double& milliseconds) {
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size());
    draco::Decoder decoder;
    const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
    if (!type.ok()) return fail(ErrorKind::corrupt_stream, "Draco cannot decode what it coded");
    std::unique_ptr<draco::PointCloud> cloud;
    Mesh mesh;
    const Stopwatch watch(1);
    if (type.value() == draco::TRIANGULAR_MESH) {
        auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
        milliseconds = watch.milliseconds();
        if (!decoded.ok()) return fail(ErrorKind::corrupt_stream, "Draco cannot decode what it coded");
        auto packed = std::move(decoded).value();
        for (draco::FaceIndex f(0); f < packed->num_faces(); ++f) {
            const auto& face = packed->face(f);
            mesh.triangles.push_back({face[0].value(), face[1].value(), face[2].value()});
        }
        cloud = std::move(packed);
    } else {
        auto decoded = decoder.DecodePointCloudFromBuffer(&buffer);
        milliseconds = watch.milliseconds();
        if (!decoded.ok()) return fail(ErrorKind::corrupt_stream, "Draco cannot decode what it coded");
        cloud = std::move(decoded).value();
    }
    read_vertices(*cloud, settings.colour_step, mesh);
    return mesh;
}

Result<CodedFrame> code_by_draco(const SourceFrame& frame, const DracoSettings& settings) {
    CodedFrame out;
    if (frame.mesh.positions.empty()) return out;
    const bool colours = !frame.mesh.colours.empty();
    const auto bytes = encode(frame.mesh, settings, colours, out.encode_ms);
    if (!bytes) return tl::unexpected(bytes.error());
    out.bytes[Layer::external_intra] = bytes->size();
    if (colours) {
        // The share of its colours: what the same frame takes less without them.
        double not_counted = 0;
        const auto geometry = encode(frame.mesh, settings, false, not_counted);
        if (!geometry) return tl::unexpected(geometry.error());
        out.bytes[Layer::external_intra] = std::min(geometry->size(), bytes->size());
        out.bytes[Layer::colour] = bytes->size() - out.bytes[Layer::external_intra];
        out.bytes.overhead = 1;
    }
    out.decode_ms = 0;
    auto decoded = decode(*bytes, settings, *out.decode_ms);
    if (!decoded) return tl::unexpected(decoded.error());
    out.decoded = std::move(*decoded);
    return out;
}

}  // namespace

int draco_position_bits(double side, double step) {
    if (!(side > 0 && step > 0)) return 1;
    return static_cast<int>(std::clamp(std::lround(std::log2(side / step + 1)), 1L, 30L));
}

CoderUnderTest draco_under_test(const std::string& name, int compression_level) {
    CoderUnderTest out;
    out.name = name;
    out.description = fmt::format("Draco at compression level {}, every frame by itself", compression_level);
    out.settings = fmt::format("compression level {}", compression_level);
    out.start = [compression_level](const SequenceFacts& facts, const QualityPoint& quality) -> Result<FrameCoder> {
        DracoSettings settings;
        settings.speed = 10 - compression_level;
        settings.position_bits = draco_position_bits(facts.frame_side, quality.geometry_step);
        settings.colour_step = std::max(1, static_cast<int>(std::lround(quality.colour_step)));
        return FrameCoder([settings](const SourceFrame& frame) { return code_by_draco(frame, settings); });
    };
    out.describe_quality = [](const SequenceFacts& facts, const QualityPoint& quality) {
        const int bits = draco_position_bits(facts.frame_side, quality.geometry_step);
        return fmt::format("{} bits ({:.2f} mm)", bits, facts.frame_side / (std::exp2(bits) - 1));
    };
    return out;
}

// ---- Peers: other programs ------------------------------------------------------------------------------------------

namespace {

using std::filesystem::path;

// The end of a command's output.
std::string last_words(const path& file) {
    const auto bytes = read_file(file, 1 << 20);
    if (!bytes) return {};
    std::string text(bytes->begin(), bytes->end());
    while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
    if (text.size() > 300) text = "... " + text.substr(text.size() - 300);
    return text;
}

Result<CodedFrame> code_by_command(const std::string& name, const std::string& command, const path& folder,
                                   std::map<std::string, std::string> values, const SourceFrame& frame) {
    const path in = folder / "in.ply", out = folder / "out.bin", decoded = folder / "decoded.ply", log = folder / "log";
    std::error_code ignored;
    std::filesystem::remove(out, ignored);
    std::filesystem::remove(decoded, ignored);
    if (auto written = write_mesh(in, frame.mesh); !written) return tl::unexpected(written.error());
    values["in"] = quoted_for_shell(in.string());
    values["out"] = quoted_for_shell(out.string());
    values["decoded"] = quoted_for_shell(decoded.string());
    const std::string line =
        fmt::format("( {} ) >{} 2>&1 </dev/null", substitute(command, values), quoted_for_shell(log.string()));
    const auto start = std::chrono::steady_clock::now();
    const int status = std::system(line.c_str());
    CodedFrame coded;
    coded.encode_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    if (status != 0)
        return fail(ErrorKind::bad_input, fmt::format("the command of {} failed: {}", name, last_words(log)));
    std::error_code missing;
    const auto bytes = std::filesystem::file_size(out, missing);
    if (missing) return fail(ErrorKind::bad_input, fmt::format("the command of {} wrote no {{out}}", name));
    coded.bytes[Layer::external_intra] = bytes;
    auto mesh = read_mesh(decoded);
    if (!mesh)
        return fail(ErrorKind::bad_input,
                    fmt::format("what {} decoded cannot be read: {}", name, mesh.error().message));
    coded.decoded = std::move(*mesh);
    return coded;
}

}  // namespace

std::string quoted_for_shell(const std::string& text) {
    std::string out = "'";
    for (const char c : text) {
        if (c == '\'')
            out += "'\\''";
        else
            out += c;
    }
    return out + "'";
}

std::string substitute(const std::string& text, const std::map<std::string, std::string>& values) {
    std::string out;
    for (std::size_t i = 0; i < text.size();) {
        const std::size_t end = text[i] == '{' ? text.find('}', i) : std::string::npos;
        const auto value = end == std::string::npos ? values.end() : values.find(text.substr(i + 1, end - i - 1));
        if (value == values.end()) {
            out += text[i++];
        } else {
            out += value->second;
            i = end + 1;
        }
    }
    return out;
}

Result<CoderUnderTest> peer_under_test(const std::string& name_and_command) {
    const auto equals = name_and_command.find('=');
    const std::string name = name_and_command.substr(0, equals);
    const std::string letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
    if (equals == std::string::npos || name.empty() || name[0] == '.' ||
        name.find_first_not_of(letters) != std::string::npos)
        return fail(ErrorKind::bad_input,
                    "--peer " + name_and_command + ": give NAME=COMMAND, the name of letters, digits, dots, _ and -");
    const std::string command = name_and_command.substr(equals + 1);
    for (const char* needed : {"{in}", "{out}", "{decoded}"})
        if (command.find(needed) == std::string::npos)
            return fail(ErrorKind::bad_input, fmt::format("--peer {}: the command does not name {}", name, needed));
    CoderUnderTest out;
    out.name = name;
    out.description = "an external command, frame by frame";
    out.settings = command;
    out.start = [name, command](const SequenceFacts& facts, const QualityPoint& quality) -> Result<FrameCoder> {
        const std::map<std::string, std::string> values = {
            {"q", fmt::format("{:g}", quality.quality)},
            {"step", fmt::format("{:g}", quality.geometry_step)},
            {"colour_step", fmt::format("{:g}", quality.colour_step)},
            {"bits", fmt::format("{}", draco_position_bits(facts.frame_side, quality.geometry_step))}};
        return FrameCoder([name, command, values, folder = quality.working_folder](const SourceFrame& frame) {
            return code_by_command(name, command, folder, values, frame);
        });
    };
    return out;
}

}  // namespace htvm::lab
