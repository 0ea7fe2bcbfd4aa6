// The pictures of a textured capture, coded and laid behind the frames of its stream.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "command_line/choice.h"
#include "core/image.h"
#include "htvm/packet.hpp"
#include "htvm/picture_encoder.hpp"
#include "htvm/result.hpp"
#include "htvm/texture.hpp"
#include "texture/film_picture.h"
#include "texture/texture_baking.h"

namespace CLI {
class App;
}

namespace htvm::app {

struct TexturePictureOptions {
    int size = 0;                       // pixels of the longer side; 0: as captured, and drawn anew by the quality
    std::optional<PictureCoder> codec;  // av1 or vp9; not given: av1
    std::optional<double> quality;      // 0..100; not given: that of the meshes
};

inline constexpr std::array video_codecs = {
    Choice<PictureCoder>{"av1", PictureCoder::av1},
    Choice<PictureCoder>{"vp9", PictureCoder::vp9},
};

// Adds --texture-size, --texture-codec and --texture-quality to a command.
void add_texture_picture_options(CLI::App& command, TexturePictureOptions& options);

// ---- One scale of quality -------------------------------------------------------------------------------------------
// At a quality neither meshes nor pictures spend bits that the others' errors hide: it says how fine positions are
// (quality_steps()), the pictures' quantiser, and how many pixels they have. Measured: docs/experiments/
// one_scale_of_quality.md.

// The coder's quantiser; foresees: PictureEncoderOptions::foresight.
int quantiser_of(PictureCoder coder, double quality, bool foresees = false);

// The side of pictures that are drawn anew, from that of the default quality: a multiple of 64, so that what is drawn
// at a finer quality loses less to being drawn, and at a coarser one no bits go into pixels that nobody sees.
int picture_side_of(int usual_side, double quality);

// The size of pictures of a film: with this longer side, or by the quality, the film's own from the default quality on.
struct PictureSize {
    int width = 0, height = 0;
};
PictureSize film_size_of(const FilmWindow& film, int longer_side);
PictureSize film_size_at(const FilmWindow& film, double quality);

// What the meshes are given of a rate for both, where one pass has to do.
inline constexpr double share_of_meshes = 0.5;

struct PictureTotals {
    std::size_t pictures = 0, key_pictures = 0;
    std::uint64_t bytes = 0;  // of their packets
    double seconds = 0;       // that coding them took
    double baking_seconds = 0;
};

// Takes the picture of each frame that goes into the encoder of meshes, and lays it behind that frame's packet. With
// foresight packets wait for their pictures.
class PictureTrack {
public:
    // Pictures have one size, which images of others are brought to. With keep, files go as they are. bits_per_second:
    // of meshes and pictures together; 0: by the quality, which may be above 100.
    struct Settings {
        TexturePictureOptions options;
        bool keep = false;
        bool bake = false;          // images are drawn anew in the layout of the meshes shown
        int width = 0, height = 0;  // of the pictures
        double quality = 50, frames_per_second = 30;
        double bits_per_second = 0, buffer_seconds = 1;
        // Pictures may be coded by those that follow, where the coder can: so fast (PictureEncoderOptions::speed).
        std::optional<int> speed_ahead;
        unsigned threads = 0;
    };
    static Result<PictureTrack> create(const Settings& settings);

    // The picture of a frame with this timestamp: a later frame without one shows it too.
    // film: where the picture is a camera's film, the part of it that is sent.
    void add(std::int64_t timestamp_us, std::shared_ptr<const TexturedMesh> textured,
             std::optional<FilmWindow> film = std::nullopt);
    // Whether it wants to know what is shown of each frame, which is drawn on.
    bool bakes() const { return baker_.has_value(); }
    // Before the frame's packet comes. repeated: Encoder::repeated_vertices().
    void show(std::uint32_t frame, Mesh mesh, std::vector<std::uint32_t> repeated) {
        shown_[frame] = {std::move(mesh), std::move(repeated)};
    }
    // Takes every packet of the stream, in order, and gives those that are ready, each with its picture behind it: none
    // where the picture is the one before, and the frame none to start at. What packets leave of the rate, pictures
    // take.
    Result<std::vector<Packet>> lay_behind(Packet packet);
    // No more packets come: gives what waits.
    Result<std::vector<Packet>> finish();
    // The rate of all, from the next picture on.
    void set_bitrate(double bits_per_second) { bits_per_second_ = bits_per_second; }
    const PictureTotals& totals() const { return totals_; }

private:
    struct Waiting {
        std::int64_t timestamp_us;
        std::shared_ptr<const TexturedMesh> textured;
        std::optional<FilmWindow> film;
    };
    struct Shown {
        Mesh mesh;
        std::vector<std::uint32_t> repeated;
    };
    using Gains = std::array<std::uint16_t, 3>;
    // A packet of the stream that is not yet given out.
    struct Held {
        Packet packet;
        std::optional<Gains> being_coded = {};  // of the picture that the encoder of pictures has
        std::optional<Packet> picture = {};
    };
    PictureTrack() = default;
    Result<void> follow_meshes(std::size_t bytes);
    Result<void> add_picture(Held& held);
    Result<void> draw(Held& held, const TexturedMesh& captured, bool key);
    Result<void> code_as_video(Held& held, const Image& image, const Gains& gains, bool key);
    Result<Packet> kept_file(const PacketHeader& frame, const TexturedMesh& captured) const;
    Packet packet_of(const PacketHeader& frame, const Gains& gains, CodedPicture coded);
    std::vector<Packet> give_ready();

    std::uint32_t width_ = 0, height_ = 0;
    PictureCoder coder_ = PictureCoder::av1;
    std::optional<PictureEncoder> encoder_;  // none: files are kept
    std::optional<TextureBaker> baker_;
    std::map<std::uint32_t, Shown> shown_;
    std::deque<Waiting> waiting_;
    std::deque<Held> held_;
    std::shared_ptr<const Image> last_;         // that was coded
    std::optional<std::uint32_t> last_number_;  // of its frame
    std::optional<std::uint32_t> last_key_;     // of the last key picture's
    double frames_per_second_ = 30;
    double bits_per_second_ = 0;            // 0: by the quality
    std::optional<double> of_meshes_ = {};  // of these, as of late
    double set_ = 0;                        // what the encoder was told
    PictureTotals totals_;
};

}  // namespace htvm::app
