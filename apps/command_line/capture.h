// A capture as the programs read it: meshes from files or standard input, in millimetres, each with its pose and its
// time.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "command_line/capture_kind.h"
#include "command_line/choice.h"
#include "command_line/mesh_pipe.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "htvm/scene.hpp"
#include "htvm/skeleton.hpp"
#include "io/mesh_file.h"
#include "io/sequence.h"
#include "io/texture_file.h"
#include "io/timestamps.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace htvm::app {

// What becomes of a texture.
enum class TextureAs : std::uint8_t {
    by_default,   // as CaptureOptions::of_images says, of meshes that have no colours of their own
    colours,      // colours at the vertices, whatever the meshes have
    coordinates,  // coordinates stay as they are, and the image is left out
    picture,      // it is drawn anew in a layout that lasts, and coded as video
    projection,   // it is one camera's film, which is coded as video, and the camera's projection goes with it
    captured,     // coordinates and images stay as they are, the images coded as video
    keep,         // the same, with the images' files as they are
};
inline constexpr std::array texture_uses = {
    Choice<TextureAs>{"colours", TextureAs::colours},   Choice<TextureAs>{"coordinates", TextureAs::coordinates},
    Choice<TextureAs>{"picture", TextureAs::picture},   Choice<TextureAs>{"projection", TextureAs::projection},
    Choice<TextureAs>{"captured", TextureAs::captured}, Choice<TextureAs>{"keep", TextureAs::keep},
};

inline constexpr std::array up_axes = {
    Choice<UpAxis>{"x", UpAxis::plus_x},   Choice<UpAxis>{"-x", UpAxis::minus_x}, Choice<UpAxis>{"y", UpAxis::plus_y},
    Choice<UpAxis>{"-y", UpAxis::minus_y}, Choice<UpAxis>{"z", UpAxis::plus_z},   Choice<UpAxis>{"-z", UpAxis::minus_z},
};

// Adds --unit, which takes a unit of length by its symbol, or a word for none of them.
CLI::Option* add_unit(CLI::App& command, std::optional<LengthUnit>& unit, const char* none, const std::string& meaning);

struct CaptureOptions {
    // A folder, pattern, glob or file of meshes; several files; or - for PLY after PLY on standard input.
    std::vector<std::string> inputs;
    std::vector<std::string> ignored;  // globs of files and folders that are no frames, as in SequenceOptions
    std::string skeleton;              // file; empty: none
    FrameRate fps;                     // of the meshes; not given: the skeleton's, else of their timestamps, else 30
    std::string timestamps;          // file; empty: as the PLY files say, else by the files' numbers and the frame rate
    std::optional<LengthUnit> unit;  // of the mesh files; not given: by their format, else guessed from the first mesh
    double scale = 1;                // of the mesh files' positions besides
    double height = 0;               // metres: scales so that the first frame is that tall; 0: not
    UpAxis up = UpAxis::unknown;     // where the head is; unknown: y or z, along which the subject is longer
    std::size_t frames = 0;          // at most; 0: all
    std::size_t first = 0;           // frames to leave out at the beginning
    double skeleton_offset = 0;      // seconds added to the skeleton's clock
    TextureOptions texture;          // where images are
    TextureAs texture_as = TextureAs::by_default;
    // What becomes of them by default: colours, picture, which is projection where they are one camera's film, or
    // captured.
    TextureAs of_images = TextureAs::colours;
    std::string why_no_pictures;  // where these are colours, for people; empty: nobody expects pictures
    // Where these are pictures, and somebody waits for frames: why they would be too slow, for people, so that colours
    // take their place; empty: they are not. Given the first mesh, in mm, picture or projection, and the milliseconds
    // from frame to frame. No function: nobody waits.
    std::function<std::string(const TexturedMesh& first, TextureAs use, double milliseconds)> pictures_too_slow = {};
    bool tells_odd_sizes = true;             // warns of frames whose size is odd; else who looks at all of them does
    bool keeps_idle_texcoords = true;        // texture coordinates for which no image is used, unless asked for
    WhileBusy while_busy = WhileBusy::wait;  // of standard input: what becomes of frames that come faster than they are
                                             // taken
};

// Whether images go into the stream.
bool keeps_pictures(TextureAs use);

// Adds the options above to a command.
void add_capture_options(CLI::App& command, CaptureOptions& options);

// Adds --texture and --texture-origin alone, for commands that read meshes otherwise.
void add_texture_options(CLI::App& command, TextureOptions& options);

// Whether the meshes come from standard input.
bool is_piped(const CaptureOptions& options);

// What was named, for people: of several files, their folder.
std::string input_name(const CaptureOptions& options);

// Of a capture whose frames are all without vertices, for people.
std::string all_empty(const CaptureOptions& options, std::size_t frames);

// All that frames depend on besides the files, for names of kept results.
std::string key_of(const CaptureOptions& options);

class Capture {
public:
    // Opens the input, reads the skeleton and says on the terminal what it found and assumed.
    static Result<Capture> open(const CaptureOptions& options);
    // The next frame's mesh in mm, as it is to be encoded, or nothing at the end. After an error of a file the next
    // call gives the next file. A mesh that is not like the others is such an error.
    Result<std::optional<Mesh>> next();
    // Whether there can be a next frame after an error: of standard input not behind a mesh that did not come whole, as
    // nobody knows where the next one begins, nor behind one whose time is not known.
    bool survives_errors() const { return !is_lost_; }
    // Back to the first frame. From files only: standard input does not come again.
    void rewind();
    // To these frames alone, of those there were when it was opened. From files only.
    void restrict_to(std::size_t first, std::size_t frames);
    // The first frame that can be read and has vertices, by which the unit was found: its mesh, in mm, once and before
    // next(); and its pose, null where there is no skeleton. From files only.
    Mesh take_first();
    const Pose* first_pose() const { return pose_at(peeked_at_); }

    // The frame that next() gave, or failed at, last:
    const Pose* pose() const { return pose_at(*at_); }  // null where there is no skeleton
    std::int64_t timestamp_us() const { return timestamp_us_; }
    // When it was there: of standard input, when its last byte came; of files, when the caller asked for it.
    std::chrono::steady_clock::time_point came() const { return came_; }
    std::string name() const;  // its file, or its place on standard input
    // With its texture, before that became colours at vertices, or as it goes into the stream; null if it has none.
    std::shared_ptr<const TexturedMesh> textured() const { return textured_; }
    std::size_t missing_before() const { return missing_; }  // frames of the numbers between it and the one before
    std::int64_t missing_timestamp_us(std::size_t k) const;  // of those, k from 0

    const std::vector<std::filesystem::path>& files() const { return files_.paths; }  // none: standard input
    std::size_t frames() const { return frames_; }  // 0: not known, from standard input
    // What becomes of the capture's texture: as asked for, or the default, which follows from its first mesh.
    TextureAs texture_as() const { return texture_as_; }
    // The first frame that can be read, with its texture; null if it has none. Before next() and take_first().
    const TexturedMesh* first_textured() const { return peeked_ && peeked_->texture ? &*peeked_ : nullptr; }
    std::size_t dropped() const { return pipe_ ? pipe_->dropped() : 0; }
    const Skeleton& skeleton() const { return skeleton_; }
    const std::vector<double>& radii() const { return radii_; }  // from the skeleton's file; may be empty
    const FrameRate& frame_rate() const { return rate_; }
    double fps() const { return rate_.per_second(); }
    UpAxis up() const { return up_; }
    // Where the first frame's lowest vertex lies along the axis that is up, mm; 0 if none is known to be.
    double lowest() const { return lowest_; }
    // The azimuth around that axis from where the first frame is seen, if it is seen from one side only; else 0.
    double first_azimuth() const { return first_azimuth_; }
    double millimetres_per_unit() const { return millimetres_per_unit_; }  // scaling included
    const GlobalShift& global_shift() const { return shift_; }             // mm, taken off the files' positions

private:
    Result<void> find_files();
    Result<void> find_times();
    Result<void> find_listed_times();
    void find_times_in_files();
    Result<void> find_poses();
    Result<void> find_first();
    Result<void> look_for_images();
    void decide_texture();
    Result<void> find_unit();
    Result<Mesh> first_near_origin();
    Result<void> take_off_shift();
    void find_kind();
    Result<void> read_first_again();
    void find_axes();
    void tell(const std::vector<MeshRemark>& remarks, const std::string& name) const;
    void tell_of_size(const Mesh& mesh) const;
    void tell_of_texture() const;
    TextureUse texture_use() const;
    TextureFiles& textures();
    // A frame as it is encoded: with colours at vertices in place of the texture, or none where that goes into the
    // stream. textured: as captured; null if there is no texture.
    struct Encodable {
        Mesh mesh;
        std::shared_ptr<const TexturedMesh> textured;
        std::vector<MeshRemark> remarks = {};
        ColourLevels levels = {};  // of colours whose type does not say their range
    };
    // Which pictures the stream has: those of the capture, of its own layout, or one camera's film.
    enum class PicturesOf { nothing, capture, stream, film };
    PicturesOf pictures_of() const;
    // What of a captured mesh goes into the stream.
    struct Wanted {
        PicturesOf pictures = PicturesOf::nothing;
        bool idle_texcoords = true;
    };
    Wanted wanted() const;
    static Encodable as_encoded(TexturedMesh captured, const Wanted& wanted);
    // From the files, on whichever thread.
    static Result<Encodable> read(TextureFiles& files, std::size_t place, TextureUse use,
                                  const MeshFileOptions& options, const Wanted& wanted);
    std::optional<std::size_t> go_to_next_file();  // its place; none behind the last one
    Result<std::optional<TexturedMesh>> read_next_file();
    Result<std::optional<Encodable>> read_file();
    void begin_to_read_next();
    MeshFileOptions mesh_options() const;
    Result<std::optional<TexturedMesh>> read_pipe();
    Result<void> find_piped_time(std::size_t place, const std::string& timestamp);
    std::int64_t regular_time(std::uint64_t place) const;
    const Pose* pose_at(std::size_t place) const;

    CaptureOptions options_;
    SequenceFiles files_;
    std::vector<std::uint64_t> places_;     // of the files in time, in frames
    std::shared_ptr<MeshPipe> pipe_;        // standard input; copies share it
    bool is_lost_ = false;                  // the place on standard input, or in time
    FrameTimes listed_;                     // of --timestamps
    std::vector<std::int64_t> file_times_;  // microseconds, of each file, where they are not regular
    FrameRate rate_{30000, 1000};
    FrameRate rate_of_recording_;      // that a recording says; numerator 0: it does not
    bool rate_is_told_ = true;         // else the first mesh on standard input may say it
    double millimetres_per_unit_ = 0;  // 0: not known yet
    GlobalShift shift_{};
    CaptureKind kind_;
    std::optional<ColourRange> colour_range_;  // of colours whose type does not say it
    struct Told {
        std::mutex mutex;
        std::set<std::string> about;      // MeshRemark::about
        std::set<std::string> odd_sizes;  // frames, by name
    };
    std::shared_ptr<Told> told_ = std::make_shared<Told>();  // copies tell nothing twice
    UpAxis up_ = UpAxis::unknown;
    double lowest_ = 0, first_azimuth_ = 0;
    Skeleton skeleton_;
    std::vector<Pose> poses_;
    std::vector<double> radii_;
    std::size_t begin_ = 0, frames_ = 0;  // place of the first frame; their number, 0 where it is not known

    TextureFiles textures_;     // until ahead_ has it
    bool has_texture_ = false;  // whether the first mesh has one that is used
    TextureAs texture_as_ = TextureAs::by_default;
    std::optional<TexturedMesh> peeked_;  // the first mesh that can be read, in mm, read beforehand to tell its unit
    std::size_t peeked_at_ = 0;           // its place
    std::size_t next_ = 0, taken_ = 0;    // place of the next frame; frames that next() gave or failed at
    std::optional<std::size_t> at_;       // place of the last one
    std::int64_t timestamp_us_ = 0, before_us_ = 0;  // of the last one and of the one before
    std::chrono::steady_clock::time_point came_{};
    std::size_t missing_ = 0;
    std::shared_ptr<const TexturedMesh> textured_;

    // The next file, which is read while the caller has the one before: of Draco that takes a fifth as long as to
    // encode it. The thread that reads has `files` to itself until its mesh is taken.
    struct Ahead {
        TextureFiles files;
        std::size_t place = 0;
        std::future<Result<Encodable>> frame;
    };
    std::shared_ptr<Ahead> ahead_;  // a copy of a capture goes elsewhere, by restrict_to(), before it reads
};

}  // namespace htvm::app
