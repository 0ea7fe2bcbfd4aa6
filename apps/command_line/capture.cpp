#include "command_line/capture.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <utility>

#include "command_line/headings.h"
#include "command_line/subject_height.h"
#include "command_line/terminal.h"
#include "io/recording.h"
#include "io/skeleton_align.h"
#include "io/skeleton_file.h"
#include "io/skeleton_rate.h"
#include "io/texture_colours.h"
#include "metrics/front.h"
#include "metrics/percentile.h"
#include "texture/film_picture.h"

namespace htvm::app {
namespace {

// 0 for x, 1 for y, 2 for z, of an axis that is known.
std::size_t number_of(UpAxis up) { return (static_cast<std::size_t>(up) - 1) / 2; }
bool is_downwards(UpAxis up) { return static_cast<std::size_t>(up) % 2 == 0; }

// The rate at which the median interval repeats.
FrameRate rate_of(const std::vector<std::int64_t>& times) {
    std::vector<std::int64_t> intervals;
    for (std::size_t k = 1; k < times.size(); ++k) intervals.push_back(times[k] - times[k - 1]);
    const double per_second = std::clamp(1e6 / static_cast<double>(middle_of(std::move(intervals))), 0.001, 1e6);
    return {static_cast<std::uint32_t>(std::lround(per_second * 1000)), 1000};
}

// Seconds from the first mesh to the end of the last one; 0 of one mesh or an unknown number.
double duration_of(const std::vector<std::int64_t>& times, std::size_t frames, double fps) {
    if (times.size() > 1)
        return static_cast<double>(times.back() - times.front()) / 1e6 * static_cast<double>(times.size()) /
               static_cast<double>(times.size() - 1);
    return frames > 1 ? static_cast<double>(frames) / fps : 0;
}

std::string key_of_rate(const FrameRate& rate) {
    return rate.denominator == 1000 ? fmt::format("{}", rate.per_second())
                                    : fmt::format("{}/{}", rate.numerator, rate.denominator);
}

// ---- Options --------------------------------------------------------------------------------------------------------

void add_meshes(CLI::App& command, CaptureOptions& options) {
    command
        .add_option("input", options.inputs,
                    "The meshes, one file per frame (.ply, .obj, .drc, .glb, .gltf): a folder, a pattern such as\n"
                    "scan_%05d.ply, a quoted glob such as 'scan_*.ply', files in their order, or - for concatenated\n"
                    "PLY on standard input")
        ->type_name("FILE")
        ->expected(1, -1)
        ->required();
    command
        .add_option("--ignore", options.ignored,
                    "Files, and folders, that are no frames: those whose name matches this glob, such as 'template*',\n"
                    "are left out; may be given several times")
        ->type_name("GLOB")
        ->allow_extra_args(false)
        ->group(heading::input);
    command.add_option("--frames", options.frames, "Use at most this many frames; 0: all (default: all)")
        ->group(heading::input);
    command.add_option("--first", options.first, "Skip this many frames at the beginning (default: 0)")
        ->group(heading::input);
}

void add_times(CLI::App& command, CaptureOptions& options) {
    command
        .add_option_function<std::string>(
            "--fps",
            [&options](const std::string& text) {
                const auto rate = parse_frame_rate(text);
                if (!rate) throw CLI::ValidationError("--fps", rate.error().message);
                options.fps = *rate;
            },
            "Frames per second of the meshes: 25, 29.97 or 30000/1001 (default: the skeleton's rate, else by the\n"
            "timestamps, or of standard input as its first PLY says in a comment 'fps 25', else 30)")
        ->type_name("RATE")
        ->group(heading::input);
    command
        .add_option("--timestamps", options.timestamps,
                    "When each frame was captured, a file: CSV with the time in seconds or timecode, or\n"
                    "frame,timestamp; or JSON, as 'htvm info --json' prints it. Default: what the PLY files say in a\n"
                    "comment 'timestamp', unless --fps is given; else the numbers in the files' names, at --fps")
        ->type_name("FILE")
        ->group(heading::input);
}

void add_size(CLI::App& command, CaptureOptions& options) {
    add_unit(command, options.unit, "auto",
             "Unit of the mesh files: mm, cm, dm, m, in or ft (default: mm, cm or m, guessed from the first mesh's\n"
             "size; m for glTF)")
        ->group(heading::input);
    auto* scale =
        command
            .add_option("--scale", options.scale,
                        "Multiplies the positions, on top of the unit, where the capture is too large or too\n"
                        "small. The skeleton stays as it is")
            ->check(CLI::Range(1e-6, 1e6))
            ->group(heading::input);
    command
        .add_option("--height", options.height,
                    "Scales the positions so that the subject is that tall in the first frame, metres")
        ->check(CLI::Range(0.001, 1e4))
        ->excludes(scale)
        ->group(heading::input);
    add_choice(command, "--up", options.up, up_axes,
               "Where the head is: x, -x, y, -y, z or -z (default: not known; for --height, y or z, whichever way\n"
               "the subject is longer)")
        ->group(heading::input);
}

}  // namespace

CLI::Option* add_unit(CLI::App& command, std::optional<LengthUnit>& unit, const char* none,
                      const std::string& meaning) {
    std::vector<Choice<std::optional<LengthUnit>>> choices = {{none, std::nullopt}};
    for (const auto& known : length_units) choices.push_back({known.symbol, known.unit});
    return add_choice(command, "--unit", unit, choices, meaning, meant_unit);
}

void add_capture_options(CLI::App& command, CaptureOptions& options) {
    add_meshes(command, options);
    add_times(command, options);
    add_size(command, options);
    command
        .add_option("-s,--skeleton", options.skeleton,
                    "The tracked skeleton: htvm's JSON (docs/skeleton.md), BVH, or Azure Kinect's JSON. It pays with\n"
                    "--profile topology, where limbs cost more bits without it. By default it only helps to begin\n"
                    "where limbs are fast, and may be left out")
        ->type_name("FILE")
        ->group(heading::skeleton);
    command
        .add_option("--skeleton-offset", options.skeleton_offset,
                    "Seconds to add to the skeleton's clock, if it is early or late")
        ->group(heading::skeleton);
    add_texture_options(command, options.texture);
    add_choice(
        command, "--texture-as", options.texture_as, texture_uses,
        "What becomes of a texture: picture, drawn anew in a layout that lasts, and coded as video (with --profile\n"
        "tracked); projection, of one camera's film, which is coded as video beside how that camera saw each frame\n"
        "(likewise); captured, coordinates as they are and images coded as video (with --profile topology); keep,\n"
        "the same with the images' files as they are; coordinates, the same without images; or colours at the\n"
        "vertices. Default: of encode picture, or projection where the first mesh's coordinates are one camera's;\n"
        "colours with --profile topology and --profile paper, with --jobs and --job, and where frames are waited\n"
        "for, as with --deadline and a hub; of meshes that have vertex colours of their own these")
        ->group(heading::textures);
}

void add_texture_options(CLI::App& command, TextureOptions& options) {
    command
        .add_option(
            "--texture", options.files,
            "The texture, PNG, JPEG, WebP, BMP, TGA or DDS: an image for all meshes, a pattern such as\n"
            "tex_%05d.jpg for one each, a video of one each, which ffmpeg decodes, or none (default: the image that\n"
            "the meshes' files name, else the one beside a mesh that is called like it)")
        ->type_name("FILE")
        ->group(heading::textures);
    constexpr std::array edges = {Choice<TextureOrigin>{"bottom", TextureOrigin::bottom},
                                  Choice<TextureOrigin>{"top", TextureOrigin::top}};
    add_choice(
        command, "--texture-origin", options.origin, edges,
        "From which edge of the image the files count texture coordinates (default: top for glTF; bottom for OBJ\n"
        "and PLY; for Draco as both sides of the texture's seams agree)")
        ->group(heading::textures);
}

bool keeps_pictures(TextureAs use) {
    return use == TextureAs::picture || use == TextureAs::projection || use == TextureAs::captured ||
           use == TextureAs::keep;
}

std::string all_empty(const CaptureOptions& options, std::size_t frames) {
    const auto input = is_piped(options) ? "standard input" : input_name(options);
    return frames == 1
               ? input + " has no vertices: see that it holds a mesh"
               : fmt::format("none of the {} frames of {} has a vertex: see that they are meshes", frames, input);
}

bool is_piped(const CaptureOptions& options) { return options.inputs == std::vector<std::string>{"-"}; }

std::string input_name(const CaptureOptions& options) {
    const std::filesystem::path first{options.inputs[0]};
    if (options.inputs.size() == 1) return first.string();
    return first.has_parent_path() ? first.parent_path().string() : ".";
}

std::string key_of(const CaptureOptions& options) {
    std::string key = fmt::format("first {}, frames {}, fps {}, unit {}, offset {}", options.first, options.frames,
                                  key_of_rate(options.fps), options.unit ? names_of(*options.unit).symbol : "auto",
                                  options.skeleton_offset);
    if (options.scale != 1) key += fmt::format(", scale {}", options.scale);
    if (options.height > 0) key += fmt::format(", height {}, up {}", options.height, word_of(options.up, up_axes));
    if (!options.timestamps.empty()) key += ", timestamps " + options.timestamps;
    if (!options.texture.files.empty()) key += ", texture " + options.texture.files;
    if (options.texture_as != TextureAs::by_default)
        key += fmt::format(", texture as {}", word_of(options.texture_as, texture_uses));
    if (options.texture.origin != TextureOrigin::by_format)
        key += options.texture.origin == TextureOrigin::top ? ", texture from the top" : ", texture from the bottom";
    return key;
}

Result<Capture> Capture::open(const CaptureOptions& options) {
    Capture capture;
    capture.options_ = options;
    if (is_piped(options)) {
        capture.pipe_ = std::make_shared<MeshPipe>(options.while_busy);
    } else if (auto found = capture.find_files(); !found) {
        return tl::unexpected(found.error());
    }
    auto texture_options = options.texture;
    texture_options.keep_files = options.texture_as == TextureAs::keep;
    auto textures = TextureFiles::open(texture_options, capture.files_);
    if (!textures) return tl::unexpected(textures.error());
    capture.textures_ = std::move(*textures);
    if (auto found = capture.find_poses(); !found) return tl::unexpected(found.error());
    if (auto found = capture.find_first(); !found) return tl::unexpected(found.error());
    if (auto found = capture.find_unit(); !found) return tl::unexpected(found.error());
    if (auto taken = capture.take_off_shift(); !taken) return tl::unexpected(taken.error());
    capture.find_kind();
    if (auto read = capture.read_first_again(); !read) return tl::unexpected(read.error());
    capture.tell_of_texture();
    return capture;
}

Result<void> Capture::find_files() {
    auto files = find_frames(options_.inputs, {options_.ignored});
    if (!files) return tl::unexpected(files.error());
    files_ = std::move(*files);
    if (files_.recording) {
        rate_of_recording_ = files_.recording->rate;
        note(fmt::format("{}: {}, {}", input_name(options_), files_.recording->format,
                         counted(files_.paths.size(), "frame")));
        if (files_.recording->sound)
            note(fmt::format("its sound is taken by --audio {}", files_.recording->sound->string()));
    }
    for (const auto& remark : files_.remarks)
        (remark.is_loss ? warn : note)(fmt::format("{}: {}", input_name(options_), remark.text));
    places_ = places_in_time(files_);
    const std::size_t found = files_.paths.size();
    if (options_.first >= found)
        return fail(ErrorKind::bad_input,
                    fmt::format("--first {} leaves nothing: there are {} frames", options_.first, found));
    frames_ = found - options_.first;
    if (options_.frames > 0) frames_ = std::min(frames_, options_.frames);
    next_ = begin_ = options_.first;
    return {};
}

// ---- Times and poses ------------------------------------------------------------------------------------------------

std::int64_t Capture::regular_time(std::uint64_t place) const {
    return std::llround(static_cast<double>(place) / fps() * 1e6);
}

// Reads what --timestamps names.
Result<void> Capture::find_listed_times() {
    auto listed = read_frame_times(options_.timestamps, options_.fps);
    if (!listed) return tl::unexpected(listed.error());
    listed_ = std::move(*listed);
    if (pipe_) return {};
    const bool by_number = !listed_.numbers.empty() && !files_.numbers.empty();
    if (!by_number && listed_.microseconds.size() != files_.paths.size())
        return fail(ErrorKind::bad_input, fmt::format("{} has {} times, but there are {} frames", options_.timestamps,
                                                      listed_.microseconds.size(), files_.paths.size()));
    if (!by_number) {
        file_times_ = listed_.microseconds;
        return {};
    }
    for (const auto number : files_.numbers) {
        const auto found = std::lower_bound(listed_.numbers.begin(), listed_.numbers.end(), number);
        if (found == listed_.numbers.end() || *found != number)
            return fail(ErrorKind::bad_input, fmt::format("{} has no time for frame {}", options_.timestamps, number));
        file_times_.push_back(listed_.microseconds[static_cast<std::size_t>(found - listed_.numbers.begin())]);
    }
    return {};
}

// Takes the times from the comments in PLY files, where they serve.
void Capture::find_times_in_files() {
    if (timestamp_in_file(files_.paths[0]).empty()) return;
    const auto unused = [&](const std::filesystem::path& path, const std::string& why) {
        warn(fmt::format("the timestamps in the files are not used: {} {}; --timestamps gives others", path.string(),
                         why));
        file_times_.clear();
    };
    for (const auto& path : files_.paths) {
        const auto text = timestamp_in_file(path);
        if (text.empty()) return unused(path, "has none");
        const auto time = parse_time(text, options_.fps);
        if (!time) return unused(path, "has one that is not understood: " + time.error().message);
        if (!file_times_.empty() && *time <= file_times_.back())
            return unused(path, "is not later than the one before");
        file_times_.push_back(*time);
    }
}

Result<void> Capture::find_times() {
    if (!options_.timestamps.empty()) {
        if (auto found = find_listed_times(); !found) return found;
    } else if (!pipe_ && options_.fps.numerator == 0) {
        if (files_.recording)
            file_times_ = files_.recording->microseconds;
        else
            find_times_in_files();
    }
    return {};
}

Result<void> Capture::find_poses() {
    std::optional<SkeletonTrack> track;
    if (!options_.skeleton.empty()) {
        auto read = read_skeleton(options_.skeleton);
        if (!read) return tl::unexpected(read.error());
        track = std::move(*read);
    }
    if (auto found = find_times(); !found) return found;
    const auto& times = pipe_ ? listed_.microseconds : file_times_;
    const bool is_known = options_.fps.numerator > 0 || (times.size() > 1 && (!track || !track->rate_is_known));
    const std::size_t frames = places_.empty() ? times.size() : static_cast<std::size_t>(places_.back() + 1);
    if (is_known) {
        rate_ = options_.fps.numerator > 0 ? options_.fps : rate_of(times);
    } else if (track && track->rate_is_known) {
        const auto beside = times.empty() ? mesh_rate_beside(*track, frames) : MeshRate{track->fps, {}, false};
        rate_ = {static_cast<std::uint32_t>(std::lround(beside.fps * 1000)), 1000};
        if (!beside.note.empty())
            (beside.is_doubtful ? warn : note)(fmt::format("{}: {}", options_.skeleton, beside.note));
    } else if (rate_of_recording_.numerator > 0) {
        rate_ = rate_of_recording_;
    } else if (!track) {
        rate_is_told_ = false;
    }
    if (track && !track->rate_is_known) take_rate_of_meshes(*track, fps(), frames);
    if (track && (is_known || !times.empty())) {
        const auto apart = unlike_durations(*track, duration_of(times, frames, fps()));
        if (!apart.empty()) warn(fmt::format("{}: {}", options_.skeleton, apart));
    }
    if (!track) return {};
    MeshClock clock;
    clock.frames = pipe_ ? track->poses.size() : files_.paths.size();
    clock.fps = fps();
    const bool has_gaps = !places_.empty() && places_.back() + 1 != places_.size();
    for (std::size_t k = 0; !pipe_ && (has_gaps || !file_times_.empty()) && k < files_.paths.size(); ++k)
        clock.timestamps.push_back(file_times_.empty() ? static_cast<double>(places_[k]) / fps()
                                                       : static_cast<double>(file_times_[k]) / 1e6);
    AlignOptions align_options;
    align_options.offset = options_.skeleton_offset;
    align_options.first_used = begin_;
    align_options.used = options_.frames;
    auto aligned = align(*track, clock, align_options);
    if (!aligned) return fail(aligned.error().kind, options_.skeleton + ": " + aligned.error().message);
    for (const auto& line : track->notes) note(options_.skeleton + ": " + line);
    for (const auto& line : aligned->notes) note(options_.skeleton + ": " + line);
    poses_ = std::move(aligned->poses);
    skeleton_ = std::move(track->skeleton);
    radii_ = std::move(track->radii);
    return {};
}

// ---- Units ----------------------------------------------------------------------------------------------------------

// As it is in the file.
Result<std::optional<TexturedMesh>> Capture::read_next_file() {
    const auto place = go_to_next_file();
    if (!place) return std::optional<TexturedMesh>{};
    auto mesh = textures().read(*place, texture_use(), mesh_options());
    if (!mesh) return tl::unexpected(mesh.error());
    return std::optional<TexturedMesh>{std::move(*mesh)};
}

// Reads the first mesh that can be read and has vertices.
Result<void> Capture::find_first() {
    std::optional<Error> error;
    bool serves = false;
    millimetres_per_unit_ = 1;
    for (std::size_t end = begin_ + frames_;;) {
        auto mesh = pipe_ ? read_pipe() : read_next_file();
        if (mesh && !*mesh) break;
        if (!mesh && !error) error = mesh.error();
        serves = mesh && !(*mesh)->mesh.positions.empty();
        if (mesh && (serves || !peeked_)) {
            peeked_ = std::move(**mesh);
            peeked_at_ = *at_;
        }
        if (pipe_ || serves || next_ == end) break;
    }
    if (error && (!peeked_ || !(serves || pipe_))) return tl::unexpected(*error);
    if (!peeked_)
        return fail(ErrorKind::bad_input, "there is no mesh in " + (pipe_ ? "standard input" : input_name(options_)));
    // What follows on standard input is not known yet.
    if (!serves && !pipe_) return fail(ErrorKind::bad_input, all_empty(options_, frames_));
    return look_for_images();
}

// Where the first mesh has neither colours nor an image, but others have one, it lacks it, and is no example of the
// capture: the first of those looked at that has one is. These are all that have one beside them, or, as others name
// theirs inside, some from everywhere.
Result<void> Capture::look_for_images() {
    const bool needs_one = texture_use() != TextureUse::none && options_.texture.files.empty() && !peeked_->texture &&
                           peeked_->mesh.colours.empty() && !peeked_->mesh.texcoords.empty();
    if (pipe_ || !needs_one || frames_ == 1) return {};
    constexpr std::size_t most = 8;
    auto places = textures_.places_with_image_beside(begin_, begin_ + frames_, most);
    const std::size_t samples = places.empty() ? std::min(most, frames_ - 1) : 0;
    for (std::size_t k = 1; k <= samples; ++k) places.push_back(begin_ + k * (frames_ - 1) / samples);
    for (const auto place : places) {
        auto mesh = textures().read(place, texture_use(), mesh_options());
        if (!mesh || !mesh->texture || mesh->mesh.positions.empty()) continue;
        peeked_ = std::move(*mesh);
        at_ = peeked_at_ = place;
        return {};
    }
    // What was found in it, once more.
    auto again = textures().read(peeked_at_, texture_use(), mesh_options());
    if (!again) return tl::unexpected(again.error());
    peeked_ = std::move(*again);
    return {};
}

// Images become what was asked for, or the default. Colours that multiply an image's go on as colours at vertices by
// default, as pictures would be without them.
void Capture::decide_texture() {
    texture_as_ = options_.texture_as;
    if (texture_as_ != TextureAs::by_default || !peeked_->texture) return;
    texture_as_ = peeked_->mesh.colours.empty() ? options_.of_images : TextureAs::colours;
    if (texture_as_ == TextureAs::picture && is_film(*peeked_)) texture_as_ = TextureAs::projection;
    if (!keeps_pictures(texture_as_) || !options_.pictures_too_slow) return;
    options_.why_no_pictures = options_.pictures_too_slow(*peeked_, texture_as_, 1000 / rate_.per_second());
    if (!options_.why_no_pictures.empty()) texture_as_ = TextureAs::colours;
}

// From the first mesh, in its file's unit.
Result<void> Capture::find_unit() {
    const auto of_format = pipe_ ? std::nullopt : unit_of_frames(files_, peeked_at_);
    const auto near = first_near_origin();
    if (!near) return tl::unexpected(near.error());
    const auto unit = options_.unit ? *options_.unit : of_format.value_or(guess_unit(*near));
    millimetres_per_unit_ = options_.scale * millimetres_per(unit);
    const double tall = height_of(*near, options_.up);
    if (options_.height > 0) {
        if (!(tall > 0)) return fail(ErrorKind::bad_input, "--height: the first mesh is flat; give --scale or --up");
        // In whole micrometres, as the stream keeps it.
        millimetres_per_unit_ = std::max(std::round(1e6 * options_.height / tall), 1.0) / 1000;
    }
    const bool guessed = !options_.unit && options_.height == 0 && options_.scale == 1;
    if (!guessed) return {};
    const auto* format = !of_format ? "" : files_.recording ? files_.recording->format.c_str() : "glTF";
    const auto said = remark_on_height(tall, unit, format);
    if (!said.text.empty()) (said.is_loss ? warn : note)(said.text);
    return {};
}

// The first mesh in its file's unit; where it is far from the origin, read anew without the distance, as floats lose of
// its shape there.
Result<Mesh> Capture::first_near_origin() {
    constexpr double of_whole_units = 1000;
    const auto shift = pipe_ ? GlobalShift{} : shift_of(peeked_->mesh, of_whole_units);
    if (shift == GlobalShift{}) return peeked_->mesh;
    auto options = mesh_options();
    options.reading.origin = in_units(shift, of_whole_units);
    return read_mesh_of(files_, peeked_at_, options);
}

// Meshes far from their origin are read anew without it, before their positions become floats.
Result<void> Capture::take_off_shift() {
    const auto shift = shift_of(peeked_->mesh, millimetres_per_unit_);
    if (shift == GlobalShift{}) return {};
    if (pipe_) {
        warn(
            "the meshes are so far from their origin that floats lose of their shape; from files, which are read "
            "twice, a shift is taken off first");
        return {};
    }
    shift_ = shift;
    note(fmt::format(
        "the meshes are far from their origin: {:.0f}, {:.0f}, {:.0f} m are taken off, kept in the stream and "
        "added again by decode",
        static_cast<double>(shift[0]) / 1000, static_cast<double>(shift[1]) / 1000,
        static_cast<double>(shift[2]) / 1000));
    return {};
}

// What the frames have in common, from the first and some others.
void Capture::find_kind() {
    auto first =
        shift_ == GlobalShift{} ? Result<Mesh>(peeked_->mesh) : read_mesh_of(files_, peeked_at_, mesh_options());
    if (!first || (shift_ == GlobalShift{} && !scale_positions(*first, millimetres_per_unit_))) return;
    const auto& findings = textures_.findings();
    kind_.add(*first, findings, peeked_->texture != nullptr);
    const std::size_t samples = findings.colour_levels.any() ? 8 : 4;  // of others
    for (std::size_t k = 1; !pipe_ && k <= samples && frames_ > 1; ++k) {
        const auto place = begin_ + k * (frames_ - 1) / samples;
        if (place == peeked_at_ || (k > 1 && place == begin_ + (k - 1) * (frames_ - 1) / samples)) continue;
        MeshFindings others;
        const auto mesh = read_mesh_of(files_, place, mesh_options(), &others);
        // Whether it has its image is said once it is encoded; one of a texture needs no range of colours.
        if (peeked_->texture && !findings.colour_levels.any()) others = {};
        if (mesh) kind_.add(*mesh, others, peeked_->texture != nullptr);
    }
    colour_range_ = kind_.colour_range();
    if (colour_range_ && *colour_range_ != ColourRange::unit)
        note(fmt::format("the numbers of the colours are taken for 0 to {}, as most of them are",
                         *colour_range_ == ColourRange::bytes ? 255 : 65535));
}

// The step of floats as far from the origin as the shift is, mm, if the file's coordinates lie on it: it held floats.
// 0: it did not, or there is no shift. The mesh is without the shift, in mm.
double step_of_floats(const Mesh& mesh, const GlobalShift& shift, double millimetres_per_unit) {
    const auto origin = in_units(shift, millimetres_per_unit);
    double step = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const auto farthest = static_cast<float>(origin[c]);
        if (farthest == 0) continue;
        const double of_axis = static_cast<double>(std::nextafter(std::abs(farthest), 3e38f) - std::abs(farthest));
        // Next to a power of two the step changes.
        const double finest = of_axis / 2;
        constexpr std::size_t most = 200;
        for (std::size_t v = 0; v < mesh.positions.size(); v += mesh.positions.size() / most + 1) {
            const double steps =
                (static_cast<double>(mesh.positions[v][c]) / millimetres_per_unit + origin[c]) / finest;
            if (std::abs(steps - std::round(steps)) > 0.05) return 0;
        }
        step = std::max(step, of_axis * millimetres_per_unit);
    }
    return step;
}
constexpr double coarse_step = 0.05;  // mm: below that it shows nowhere

// The first mesh, as all are read from here on.
Result<void> Capture::read_first_again() {
    const bool is_other = shift_ != GlobalShift{} || colour_range_;
    decide_texture();
    if (!pipe_ && is_other) {
        auto again = textures_.read(peeked_at_, texture_use(), mesh_options());
        if (!again) return tl::unexpected(again.error());
        peeked_ = std::move(*again);
    } else if (auto ok = scale_positions(peeked_->mesh, millimetres_per_unit_); !ok) {
        return ok;
    }
    if (keeps_pictures(texture_as_) && textures_.findings().texture.colours_multiply && peeked_->texture &&
        !peeked_->mesh.colours.empty())
        warn(
            "the colours at vertices, which multiply those of the images, are left out of the pictures; --texture-as "
            "colours has both");
    if (const double step = step_of_floats(peeked_->mesh, shift_, millimetres_per_unit_); step > coarse_step)
        warn(
            fmt::format("the files hold floats, which are exact to {} there: where they are written, take the distance "
                        "off first, or write doubles",
                        length_text(step)));
    tell(textures_.findings().remarks, pipe_ ? name() : files_.paths[peeked_at_].string());
    has_texture_ = peeked_->texture != nullptr;
    find_axes();
    // From files all is read again but what is kept.
    if (!pipe_) next_ = begin_;
    at_.reset();
    return {};
}

void Capture::tell(const std::vector<MeshRemark>& remarks, const std::string& name) const {
    const std::lock_guard lock(told_->mutex);
    for (const auto& [about, text, is_loss] : remarks) {
        const bool is_told_of_texture = about == "no-image" && !is_loss;  // tell_of_texture() says it of all
        if (is_told_of_texture || !told_->about.insert(about).second) continue;
        const auto line = fmt::format("{}: {}; other frames like it are not told", name, text);
        is_loss ? warn(line) : note(line);
    }
}

// Finds which axis --up names, where the first mesh ends on it, and which way it faces around it.
void Capture::find_axes() {
    up_ = options_.up;
    if (up_ == UpAxis::unknown) return;
    const auto axis = number_of(up_);
    if (const auto bounds = surface_bounds(peeked_->mesh))
        lowest_ = static_cast<double>(is_downwards(up_) ? bounds->high[axis] : bounds->low[axis]);
    if (const auto facing = facing_of(peeked_->mesh)) first_azimuth_ = azimuth_of(*facing, up_).value_or(0);
}

// ---- Frames ---------------------------------------------------------------------------------------------------------

TextureUse Capture::texture_use() const {
    if (options_.texture_as == TextureAs::coordinates) return TextureUse::none;
    return options_.texture_as == TextureAs::by_default ? TextureUse::where_colourless : TextureUse::always;
}

// Warns of a frame whose size is odd, though it may be meant so.
void Capture::tell_of_size(const Mesh& mesh) const {
    const auto odd = kind_.odd_size(mesh);
    if (odd.empty()) return;
    constexpr std::size_t most = 3;  // by name
    const std::lock_guard lock(told_->mutex);
    if (!told_->odd_sizes.insert(name()).second) return;
    if (told_->odd_sizes.size() <= most)
        warn(fmt::format("{}: it is {}", name(), odd));
    else if (told_->odd_sizes.size() == most + 1)
        warn("more frames are of another size than the others: htvm check names them");
}

// What becomes of the first mesh's texture.
void Capture::tell_of_texture() const {
    const auto& image = textures_.image_name();
    const auto& mesh = peeked_->mesh;
    const auto& texture = peeked_->texture;
    const bool is_default = options_.texture_as == TextureAs::by_default;
    if (texture && keeps_pictures(texture_as_)) {
        note(
            fmt::format("the texture ({}, {} x {} pixels) is {}{}", image, texture->width, texture->height,
                        texture_as_ == TextureAs::keep      ? "kept as it is"
                        : texture_as_ == TextureAs::picture ? "drawn anew in a layout that lasts, and coded as video"
                        : texture_as_ == TextureAs::projection
                            ? "one camera's film, and coded as video with that camera's projection"
                            : "coded as video, with its coordinates as captured",
                        !is_default ? ""
                        : texture_as_ == TextureAs::projection
                            ? "; --texture-as colours has its colours at the vertices instead, without its details"
                            : "; --texture-as colours has its colours at the vertices instead, without its details, in "
                              "less time and with fewer bits"));
    } else if (texture) {
        note(fmt::format("the colours are those of the texture ({}, {} x {} pixels) at the vertices{}", image,
                         texture->width, texture->height,
                         !is_default                        ? ""
                         : !peeked_->mesh.colours.empty()   ? ", times those that these have"
                         : options_.why_no_pictures.empty() ? ""
                                                            : ", without its details: " + options_.why_no_pictures));
    } else if (mesh.texcoords.empty()) {
        const bool asked =
            options_.texture_as == TextureAs::coordinates || options_.texture.origin != TextureOrigin::by_format;
        if (asked)
            note(
                "the meshes have no texture coordinates, so there is nothing to do for --texture-as or "
                "--texture-origin");
    } else if (!wanted().idle_texcoords && (image.empty() || options_.texture.files == "none")) {
        note(
            options_.texture.files == "none"
                ? std::string(
                      "the texture coordinates are left out with their image; --texture-as coordinates keeps them")
                : std::string("the meshes have texture coordinates, but no image was found for them, so these are left "
                              "out; --texture gives its place, --texture-as coordinates keeps them"));
    } else if (options_.texture.files == "none") {
        note(
            "the texture coordinates are encoded, without an image; meshes that are written without them take fewer "
            "bits");
    } else if (image.empty()) {
        note("the meshes have texture coordinates, but no image was found for them; --texture gives its place");
    } else if (options_.texture_as == TextureAs::coordinates) {
        note(fmt::format("the texture coordinates are encoded, their image ({}) is not", image));
    } else {
        note(
            fmt::format("the meshes have vertex colours, so their texture ({}) is not used; --texture-as colours takes "
                        "its colours",
                        image));
    }
    if (texture && textures_.is_from_top_by_seams())
        note(
            "its coordinates are taken for counted from the image's top, since so both sides of its seams agree (see "
            "--texture-origin)");
}

Capture::Encodable Capture::as_encoded(TexturedMesh captured, const Wanted& wanted) {
    const auto pictures = wanted.pictures;
    if (!captured.texture) {
        if (!wanted.idle_texcoords) captured.mesh.texcoords.clear();
        return {std::move(captured.mesh), nullptr};
    }
    if (pictures == PicturesOf::capture) captured.mesh.colours.clear();
    Encodable out;
    out.textured = std::make_shared<const TexturedMesh>(std::move(captured));
    // Tracking goes by the colours at vertices, where there are pictures too.
    constexpr double texels = 2;
    if (pictures == PicturesOf::capture || pictures == PicturesOf::film) out.mesh = out.textured->mesh;
    if (pictures == PicturesOf::film)
        out.mesh.colours = colours_with_texture(*out.textured, {}, texels);
    else if (pictures != PicturesOf::capture)
        out.mesh = with_vertex_colours(*out.textured, {}, pictures == PicturesOf::stream ? texels : 1);
    return out;
}

Result<Capture::Encodable> Capture::read(TextureFiles& files, std::size_t place, TextureUse use,
                                         const MeshFileOptions& options, const Wanted& wanted) {
    auto mesh = files.read(place, use, options);
    if (!mesh) return tl::unexpected(mesh.error());
    auto out = as_encoded(std::move(*mesh), wanted);
    out.remarks = files.findings().remarks;
    out.levels = files.findings().colour_levels;
    return out;
}

Capture::Wanted Capture::wanted() const {
    return {pictures_of(), options_.keeps_idle_texcoords || options_.texture_as != TextureAs::by_default};
}

Capture::PicturesOf Capture::pictures_of() const {
    if (!keeps_pictures(texture_as_)) return PicturesOf::nothing;
    if (texture_as_ == TextureAs::projection) return PicturesOf::film;
    return texture_as_ == TextureAs::picture ? PicturesOf::stream : PicturesOf::capture;
}

MeshFileOptions Capture::mesh_options() const {
    MeshFileOptions out;
    out.millimetres_per_unit = millimetres_per_unit_;
    out.reading.colour_range = colour_range_;
    out.reading.origin = in_units(shift_, millimetres_per_unit_);
    return out;
}

std::optional<std::size_t> Capture::go_to_next_file() {
    if (next_ == begin_ + frames_) return std::nullopt;
    const std::size_t place = next_++;
    const std::int64_t before = timestamp_us_;
    missing_ = place > options_.first ? static_cast<std::size_t>(places_[place] - places_[place - 1] - 1) : 0;
    at_ = place;
    timestamp_us_ = file_times_.empty() ? regular_time(places_[place]) : file_times_[place];
    before_us_ = before;
    return place;
}

Result<std::optional<Capture::Encodable>> Capture::read_file() {
    const auto next = go_to_next_file();
    if (!next) return std::optional<Encodable>{};
    const std::size_t place = *next;
    const bool begun = ahead_ && ahead_->frame.valid() && ahead_->place == place;
    auto frame = peeked_ && place == peeked_at_ ? as_encoded(*std::exchange(peeked_, std::nullopt), wanted())
                 : begun                        ? ahead_->frame.get()
                                                : read(textures(), place, texture_use(), mesh_options(), wanted());
    // Who takes a second frame will take a third.
    if (taken_ > 0) begin_to_read_next();
    if (!frame) return tl::unexpected(frame.error());
    return std::optional<Encodable>{std::move(*frame)};
}

void Capture::begin_to_read_next() {
    const bool last = next_ == begin_ + frames_ || (options_.frames > 0 && taken_ + 1 >= options_.frames);
    if (last || (peeked_ && next_ == peeked_at_)) return;
    if (!ahead_) ahead_ = std::make_shared<Ahead>(Ahead{std::move(textures_), 0, {}});
    ahead_->place = next_;
    ahead_->frame = std::async(std::launch::async,
                               [&files = ahead_->files, place = next_, use = texture_use(), options = mesh_options(),
                                kept = wanted()] { return read(files, place, use, options, kept); });
}

Result<std::optional<TexturedMesh>> Capture::read_pipe() {
    if (peeked_) {
        at_ = peeked_at_;
        return std::exchange(peeked_, std::nullopt);
    }
    for (;;) {
        auto piped = pipe_->next();
        is_lost_ = !piped;
        if (!piped) return tl::unexpected(piped.error());
        if (!*piped) return std::optional<TexturedMesh>{};
        auto& [mesh, place, timestamp, per_second, findings, came] = **piped;
        if (place < options_.first) continue;
        at_ = place;
        came_ = came;
        // The first mesh alone says the rate, as sequence headers tell it from then on.
        if (!std::exchange(rate_is_told_, true))
            if (const auto rate = parse_frame_rate(per_second)) rate_ = *rate;
        auto timed = find_piped_time(place, timestamp);
        is_lost_ = !timed;
        if (!timed) return tl::unexpected(timed.error());
        if (auto ok = scale_positions(mesh, millimetres_per_unit_); !ok) return tl::unexpected(ok.error());
        auto textured = textures_.with_image(std::move(mesh), place, std::move(findings), texture_use());
        if (!textured) return fail(textured.error().kind, fmt::format("{}: {}", name(), textured.error().message));
        return std::optional<TexturedMesh>{std::move(*textured)};
    }
}

Result<void> Capture::find_piped_time(std::size_t place, const std::string& timestamp) {
    if (!listed_.microseconds.empty()) {
        if (place >= listed_.microseconds.size())
            return fail(ErrorKind::bad_input, fmt::format("{} has {} times, but more frames came", options_.timestamps,
                                                          listed_.microseconds.size()));
        timestamp_us_ = listed_.microseconds[place];
    } else if (timestamp.empty() || options_.fps.numerator > 0) {
        timestamp_us_ = regular_time(place);
    } else {
        const auto time = parse_time(timestamp, rate_);
        if (!time) return fail(ErrorKind::bad_input, fmt::format("{}: {}", name(), time.error().message));
        timestamp_us_ = *time;
    }
    return {};
}

Result<std::optional<Mesh>> Capture::next() {
    if (options_.frames > 0 && taken_ >= options_.frames) return std::optional<Mesh>{};
    if (!pipe_) came_ = std::chrono::steady_clock::now();
    const auto of_pipe = [&]() -> Result<std::optional<Encodable>> {
        auto mesh = read_pipe();
        if (!mesh) return tl::unexpected(mesh.error());
        if (!*mesh) return std::optional<Encodable>{};
        auto out = as_encoded(std::move(**mesh), wanted());
        out.levels = textures_.findings().colour_levels;
        return std::optional<Encodable>{std::move(out)};
    };
    auto frame = pipe_ ? of_pipe() : read_file();
    if (!frame || *frame) ++taken_;
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) return std::optional<Mesh>{};
    if (has_texture_ && !(*frame)->textured && (*frame)->mesh.colours.empty())
        return fail(ErrorKind::bad_input, fmt::format("{}: there is no image for it, as there is for others; --texture "
                                                      "gives its place, --texture-as coordinates does without images",
                                                      name()));
    tell((*frame)->remarks, name());
    if (const auto why = kind_.unlike((*frame)->mesh, (*frame)->levels, (*frame)->textured != nullptr); !why.empty()) {
        if (!pipe_) return fail(ErrorKind::bad_input, fmt::format("{}: {}", name(), why));
        // What is live goes on: there is no other frame to take.
        tell({{"unlike", why, true}}, name());
    } else if (options_.tells_odd_sizes) {
        tell_of_size((*frame)->mesh);
    }
    textured_ = std::move((*frame)->textured);
    return std::optional<Mesh>{std::move((*frame)->mesh)};
}

TextureFiles& Capture::textures() {
    if (ahead_) ahead_->frame = {};  // waits for what is being read
    return ahead_ ? ahead_->files : textures_;
}

void Capture::rewind() {
    if (ahead_) ahead_->frame = {};
    at_.reset();
    next_ = begin_;
    taken_ = 0;
}

void Capture::restrict_to(std::size_t first, std::size_t frames) {
    begin_ = options_.first + first;
    frames_ = frames;
    rewind();
}

Mesh Capture::take_first() {
    auto frame = as_encoded(*std::exchange(peeked_, std::nullopt), wanted());
    textured_ = std::move(frame.textured);
    return std::move(frame.mesh);
}

const Pose* Capture::pose_at(std::size_t place) const {
    return poses_.empty() ? nullptr : &poses_[std::min(place, poses_.size() - 1)];
}

std::string Capture::name() const {
    if (pipe_) return fmt::format("mesh {} of standard input", at_.value_or(0));
    return files_.paths[at_.value_or(begin_)].string();
}

std::int64_t Capture::missing_timestamp_us(std::size_t k) const {
    if (file_times_.empty()) return regular_time(places_[*at_] - missing_ + k);
    return before_us_ +
           (timestamp_us_ - before_us_) * static_cast<std::int64_t>(k + 1) / static_cast<std::int64_t>(missing_ + 1);
}

}  // namespace htvm::app
