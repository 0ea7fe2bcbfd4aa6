// Which image belongs to a mesh, and meshes with their images: one for all frames, or one each, in files or a video.
//
// In this order: the image that the user names; the one that the mesh's file names (map_Kd of an OBJ's material,
// "comment TextureFile" of a PLY, the base colour's texture of a glTF, which may be inside of it); the one beside the
// mesh that is called like it. What a file names is looked for in the mesh's folder and those in it, nowhere else
// (named_file.h), an OBJ's images from the folder of its material file first.
//
// Parts of a mesh may have different images, or colours in place of images: all of them go into one image, an atlas
// (texture_atlas.h), which stays the same for frames with the same images. A mesh whose parts have colours alone has
// them at its vertices. Images above 4096 x 4096 pixels are made smaller as they are read.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
#include "htvm/result.hpp"
#include "io/mesh_file.h"
#include "io/mesh_reading.h"
#include "io/named_file.h"
#include "io/sequence.h"
#include "io/texture_atlas.h"
#include "io/texture_video.h"

namespace htvm {

// From which edge of the image texture coordinates are counted in the files. By format: from the top in glTF, from the
// bottom in OBJ and PLY. Draco says nothing, and its files come in both ways: as both sides of the atlas's seams, which
// are one place of the surface, agree better in the image, which is turned over where that is from the top.
enum class TextureOrigin { by_format, bottom, top };

struct TextureOptions {
    // An image for all frames; a pattern with a %d, of an image for each; a video, whose pictures are those of the
    // frames in time; "none": no image is read; empty: those that the meshes name, or that lie beside them.
    std::string files;
    TextureOrigin origin = TextureOrigin::by_format;
    // Whether files are kept as they are, in TexturedMesh::texture_file, which needs one image for all parts of a mesh.
    // Where the seams say that coordinates are counted from the top, then these are turned over, and not the image.
    bool keep_files = false;
    std::string ffmpeg = "ffmpeg";  // the program that decodes videos
};

// Which meshes need their image.
enum class TextureUse {
    none,  // no mesh
    // Those with texture coordinates and without vertex colours, or with the same colour at all of them, as programs
    // write that never coloured any; those whose colours multiply the image's; and all if the user named the image.
    where_colourless,
    always,  // all; it is an error if there is no image
};

class TextureFiles {
public:
    // For meshes of one capture. Fails (bad_input) if the images that the options name are not there, or not for all
    // of the meshes. Without meshes (standard input) there is one image for all, or a video.
    static Result<TextureFiles> open(const TextureOptions& options, const SequenceFiles& meshes = {});

    // Reads the mesh at that place of the capture, with its image where `use` says so and there is one. Of a mesh with
    // an image, colours of vertices stay only if they multiply the image's and differ (texture_colours.h).
    Result<TexturedMesh> read(std::size_t place, TextureUse use, const MeshFileOptions& options = {});

    // The same for a mesh that was read already, from standard input, at that place among all that came.
    Result<TexturedMesh> with_image(Mesh mesh, std::size_t place, MeshFindings findings, TextureUse use);

    // What was found in the mesh that was read last.
    const MeshFindings& findings() const { return findings_; }

    // The name of the image for the mesh that was read last, whether the image was read or not; empty: there is none.
    const std::string& image_name() const { return image_name_; }

    // Whether coordinates were taken for counted from the top because of the seams.
    bool is_from_top_by_seams() const { return from_top_by_seams_.value_or(false); }

    // The images of all meshes as far as they are known before these are read.
    std::vector<std::filesystem::path> known_images() const;

    // The places of meshes from `begin` to before `end` that have an image beside them which is called like them: the
    // first so many.
    std::vector<std::size_t> places_with_image_beside(std::size_t begin, std::size_t end, std::size_t most) const;

private:
    static Result<TextureFiles> of_recording(TextureFiles files);
    struct Found {
        std::string name;
        std::filesystem::path path;  // empty: the bytes are inside of the mesh's file
        const std::vector<std::uint8_t>* bytes = nullptr;
        std::optional<std::size_t> picture = {};  // of the video
    };
    struct ReadImage {
        std::shared_ptr<const Image> image;
        std::shared_ptr<const std::vector<std::uint8_t>> file;  // where it is to be kept
        std::vector<MeshRemark> remarks;
    };
    // An image that the next frame may have too.
    struct Kept {
        std::filesystem::path path;
        std::vector<std::uint8_t> bytes;
        std::optional<std::size_t> picture;
        ReadImage read;
        bool is_of(const Found& found) const;
    };
    // Which images a mesh shows.
    struct Shown {
        std::vector<Found> images;  // none: it has none
        bool is_of_parts = false;   // each of its parts says which; else one is for all
    };
    Result<TexturedMesh> completed(Mesh mesh, const std::filesystem::path& path, std::size_t place, TextureUse use);
    void take_parts(const Mesh& mesh, const std::filesystem::path& path);
    void remark_on_one_for_all(const Mesh& mesh, const std::filesystem::path& path);
    Result<Shown> find(const Mesh& mesh, const std::filesystem::path& path, std::size_t place);
    Result<Shown> find_of_parts(const std::vector<bool>& worn, const std::filesystem::path& path);
    TexturedMesh without_image(Mesh mesh);
    Result<TexturedMesh> with_images(Mesh mesh, const std::filesystem::path& path, const Shown& shown);
    Result<TexturedMesh> with_atlas(Mesh mesh, std::vector<AtlasPart> parts, const std::vector<std::size_t>& place_of);
    TexturedMesh with_one_image(Mesh mesh, const std::filesystem::path& path, ReadImage image, const Colour& colour);
    std::vector<AtlasPart> parts_with(const std::vector<ReadImage>& images, const std::vector<bool>& worn,
                                      const Shown& shown) const;
    Result<std::vector<ReadImage>> read_images(const std::vector<Found>& found, const std::filesystem::path& mesh);
    Result<ReadImage> read_image_of(const Found& found, const std::filesystem::path& mesh);
    Result<ReadImage> picture_of_video(std::size_t number, const std::filesystem::path& mesh);

    TextureOptions options_;
    SequenceFiles meshes_;
    std::vector<std::filesystem::path> images_;  // that the user named: one for all, or one for each mesh
    std::optional<TextureVideo> video_;          // or this
    std::vector<std::uint64_t> times_;           // of the meshes in the video, in pictures
    std::string image_name_;
    MeshFindings findings_;
    NamedFiles named_;
    std::optional<bool> from_top_by_seams_;  // decided by the first mesh that has seams
    std::vector<Kept> kept_;                 // of the frame before
    Atlas atlas_;                            // that was made last
    // The image that was turned over or multiplied by a colour last, and what became of it.
    struct Changed {
        std::shared_ptr<const Image> from, to;
        Colour colour{};
    };
    Changed turned_, multiplied_;
};

}  // namespace htvm
