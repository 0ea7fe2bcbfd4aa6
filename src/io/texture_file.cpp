#include "io/texture_file.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <system_error>
#include <utility>

#include "io/image_file.h"
#include "io/obj.h"

namespace htvm {

using namespace internal;

namespace {

namespace fs = std::filesystem;

constexpr const char* other_ways = "; --texture gives its place, or none to go on without";

tl::unexpected<Error> fail_at(const fs::path& mesh, ErrorKind kind, const std::string& message) {
    return fail(kind, mesh.empty() ? message : mesh.string() + ": " + message);
}

fs::path folder_of(const fs::path& mesh) { return mesh.has_parent_path() ? mesh.parent_path() : fs::path("."); }

// The file of that name in the folder or below it; the last part of the name alone if it leads elsewhere, as where a
// program wrote its own folders into it.
std::optional<fs::path> file_within(const fs::path& folder, const std::string& name) {
    if (name.empty() || name.find('\0') != name.npos) return std::nullopt;
    std::error_code error;
    const auto inside = fs::canonical(folder, error);
    if (error) return std::nullopt;
    const auto last_part = name.substr(name.find_last_of("/\\") + 1);
    for (const auto& tried : {name, last_part}) {
        if (tried.empty() || !fs::is_regular_file(folder / tried, error)) continue;
        const auto path = fs::canonical(folder / tried, error);
        if (error) continue;
        if (std::mismatch(inside.begin(), inside.end(), path.begin(), path.end()).first == inside.end())
            return folder / tried;
    }
    return std::nullopt;
}

// The images of an OBJ's materials. A material file that is not there says nothing: many an OBJ names one that was
// never sent along.
Result<TextureReference> with_materials(const fs::path& mesh, const TextureReference& said) {
    TextureReference out = said;
    if (said.material_files.empty() || said.parts.empty()) return out;
    std::vector<ObjMaterial> known;
    for (const auto& name : said.material_files) {
        const auto path = file_within(folder_of(mesh), name);
        if (!path) continue;
        constexpr std::uint64_t most_bytes = std::uint64_t{1} << 26;
        const auto bytes = read_file(*path, most_bytes);
        if (!bytes) return tl::unexpected(bytes.error());
        const auto more = read_obj_materials({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
        known.insert(known.end(), more.begin(), more.end());
    }
    for (auto& part : out.parts) {
        const auto material = std::ranges::find(known, part.material, &ObjMaterial::name);
        if (material != known.end() && !material->image.empty()) part.image = add_image(out, material->image);
    }
    return out;
}

std::string lower_case(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    return text;
}

// Adds to the error which files are taken, if the name is not even that of an image.
Error with_what_is_taken(Error error, const fs::path& path) {
    const bool is_image =
        std::ranges::find(image_extensions, lower_case(path.extension().string())) != std::end(image_extensions);
    if (is_image) return error;
    error.message += ", or, where it has a picture for each mesh, as a video:";
    for (const char* extension : video_extensions) error.message += std::string(" ") + extension;
    return error;
}

// An image beside the mesh that is called like it.
std::optional<fs::path> image_beside(const fs::path& mesh) {
    std::error_code error;
    for (const char* extension : image_extensions) {
        std::string upper = extension;
        std::transform(upper.begin(), upper.end(), upper.begin(),
                       [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
        for (const std::string& tried : {std::string(extension), upper}) {
            fs::path path = mesh;
            path.replace_extension(tried);
            if (fs::is_regular_file(path, error)) return path;
        }
    }
    return std::nullopt;
}

// The images of a pattern, one for each mesh: by number where every mesh's has one, else in order.
Result<std::vector<fs::path>> images_of_pattern(const std::string& pattern, const SequenceFiles& images,
                                                const SequenceFiles& meshes) {
    std::vector<fs::path> out;
    std::optional<std::uint64_t> missing;
    for (const auto number : meshes.numbers) {
        const auto at = std::lower_bound(images.numbers.begin(), images.numbers.end(), number);
        if (at != images.numbers.end() && *at == number)
            out.push_back(images.paths[static_cast<std::size_t>(at - images.numbers.begin())]);
        else if (!missing)
            missing = number;
    }
    if (!meshes.numbers.empty() && !missing) return out;
    if (images.paths.size() == meshes.paths.size()) return images.paths;
    return fail(ErrorKind::bad_input, "--texture " + pattern + " gives " + std::to_string(images.paths.size()) +
                                          " images for " + std::to_string(meshes.paths.size()) + " meshes" +
                                          (missing ? ", and none has the number " + std::to_string(*missing) : "") +
                                          "; give an image for each, or one for all");
}

// Draco files alone: the others' formats say it.
bool says_no_origin(const fs::path& mesh) {
    const auto extension = mesh.extension();
    return extension == ".drc" || extension == ".DRC";
}

// How much the colours of the two sides of seams differ, from the bottom and from the top of the image; nothing if the
// mesh has no seam.
struct SeamDifference {
    double from_bottom = 0, from_top = 0;
};
std::optional<SeamDifference> difference_at_seams(const Mesh& mesh, const Image& image) {
    const ImagePyramid texture(image);
    std::map<Vector3f, std::size_t> first_at;
    SeamDifference out;
    bool any = false;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const auto first = first_at.emplace(mesh.positions[v], v).first->second;
        const Vector2f &a = mesh.texcoords[first], &b = mesh.texcoords[v];
        if (a == b) continue;
        any = true;
        const auto add = [&](double& sum, float av, float bv) {
            const auto one = texture.at(a[0], av), other = texture.at(b[0], bv);
            for (std::size_t c = 0; c < 3; ++c) sum += std::abs(static_cast<double>(one[c] - other[c]));
        };
        add(out.from_bottom, a[1], b[1]);
        add(out.from_top, 1 - a[1], 1 - b[1]);
    }
    return any ? std::optional(out) : std::nullopt;
}

Image turned_over(const Image& image) {
    Image out{image.width, image.height, {}};
    const auto row = 3 * static_cast<std::ptrdiff_t>(image.width);
    for (auto end = image.rgb.end(); end != image.rgb.begin(); end -= row)
        out.rgb.insert(out.rgb.end(), end - row, end);
    return out;
}

void turn_over(Mesh& mesh) {
    for (auto& texcoord : mesh.texcoords) texcoord[1] = 1 - texcoord[1];
}

}  // namespace

Result<TextureFiles> TextureFiles::open(const TextureOptions& options, const SequenceFiles& meshes) {
    TextureFiles out;
    out.options_ = options;
    out.meshes_ = meshes;
    const auto& what = options.files;
    if (what.empty() || what == "none") return out;
    std::error_code error;
    if (fs::is_directory(what, error) || (!fs::exists(what, error) && what.find_first_of("*?") != what.npos))
        return fail(ErrorKind::bad_input, "--texture " + what + " is no image; give one for all frames, or a pattern " +
                                              "such as tex_%05d.jpg");
    const auto images = find_sequence(what);
    if (!images) return fail(images.error().kind, "--texture: " + images.error().message);
    const bool is_pattern = images->paths != std::vector<fs::path>{what};
    if (!is_pattern && is_video_file_name(what)) {
        if (options.keep_files)
            return fail(
                ErrorKind::bad_input,
                "--texture " + what + " is a video, whose pictures are no files that could be kept as they are");
        auto video = TextureVideo::open(what, options.ffmpeg);
        if (!video) return fail(video.error().kind, "--texture: " + video.error().message);
        out.video_ = std::move(*video);
        out.times_ = places_in_time(meshes);
        return out;
    }
    if (!is_pattern) {
        out.images_ = images->paths;
        return out;
    }
    if (meshes.paths.empty())
        return fail(ErrorKind::bad_input,
                    "--texture " + what + ": meshes from standard input take one image for all, or a video");
    auto each = images_of_pattern(what, *images, meshes);
    if (!each) return tl::unexpected(each.error());
    out.images_ = std::move(*each);
    return out;
}

std::vector<std::filesystem::path> TextureFiles::known_images() const {
    if (video_) return {video_->path()};
    if (options_.files == "none" || !images_.empty()) return images_;
    std::vector<fs::path> out;
    for (const auto& mesh : meshes_.paths)
        if (const auto beside = image_beside(mesh)) out.push_back(*beside);
    return out;
}

Result<TextureFiles::Found> TextureFiles::find(const fs::path& mesh, std::size_t place,
                                               const TextureReference& said) const {
    Found out;
    if (options_.files == "none") return out;
    if (video_) {
        out.name = video_->path().string();
        out.picture = place < times_.size() ? static_cast<std::size_t>(times_[place]) : place;
        return out;
    }
    if (!images_.empty()) {
        out.path = images_.size() == 1 ? images_[0] : images_[place];
        out.name = out.path.string();
        return out;
    }
    const auto texture = with_materials(mesh, said);
    if (!texture) return tl::unexpected(texture.error());
    const bool is_partial =
        !texture->images.empty() && std::ranges::any_of(texture->parts, [](const auto& part) { return !part.image; });
    if (texture->images.size() > 1 || is_partial)
        return fail_at(mesh, ErrorKind::unsupported,
                       is_partial
                           ? "a part of the mesh has an image and another has none; one image for all of it is read" +
                                 std::string(other_ways)
                           : "its parts have " + std::to_string(texture->images.size()) +
                                 " images; one image for all of it is read: bake them into one" + other_ways);
    if (!texture->images.empty()) {
        out.name = texture->images[0].name;
        if (!texture->images[0].bytes.empty()) {
            out.bytes = &said.images[0].bytes;
            return out;
        }
        const auto path = file_within(folder_of(mesh), out.name);
        if (!path)
            return fail_at(mesh, ErrorKind::bad_input,
                           "its image \"" + out.name.substr(0, 200) + "\" is not in its folder" + other_ways);
        out.path = *path;
        out.name = path->string();
        return out;
    }
    if (const auto beside = mesh.empty() ? std::nullopt : image_beside(mesh)) {
        out.path = *beside;
        out.name = beside->string();
    }
    return out;
}

Result<TexturedMesh> TextureFiles::completed(Mesh mesh, const fs::path& path, std::size_t place, TextureUse use) {
    image_name_.clear();
    const bool from_top = !path.empty() && counts_texture_from_top(path);
    if ((options_.origin == TextureOrigin::top && !from_top) || (options_.origin == TextureOrigin::bottom && from_top))
        turn_over(mesh);
    if (mesh.positions.empty()) return TexturedMesh(std::move(mesh));
    const bool is_named = !images_.empty() || video_;
    if (mesh.texcoords.empty()) {
        if (is_named || use == TextureUse::always)
            return fail_at(path, ErrorKind::bad_input,
                           "the mesh has no texture coordinates, which its image needs; leave --texture out, or write "
                           "the mesh with them");
        return TexturedMesh(std::move(mesh));
    }
    const bool is_wanted =
        use == TextureUse::always || (use == TextureUse::where_colourless && (is_named || mesh.colours.empty()));
    const auto found = find(path, place, findings_.texture);
    if (!found) {
        if (!is_wanted) return TexturedMesh(std::move(mesh));
        return tl::unexpected(found.error());
    }
    image_name_ = found->name;
    if (!is_wanted) return TexturedMesh(std::move(mesh));
    if (found->name.empty()) {
        if (use != TextureUse::always) return TexturedMesh(std::move(mesh));
        return fail_at(path, ErrorKind::bad_input, "no image was found for it; --texture gives its place");
    }
    auto image = read_image_of(*found, path);
    if (!image) return tl::unexpected(image.error());
    if (options_.origin == TextureOrigin::by_format && says_no_origin(path)) {
        if (!from_top_by_seams_)
            if (const auto difference = difference_at_seams(mesh, *image->image))
                from_top_by_seams_ = difference->from_top < difference->from_bottom;
        // The image, as the coordinates are to stay what the file says wherever they are coded or compared; but a file
        // that is kept cannot be turned.
        if (is_from_top_by_seams() && options_.keep_files) {
            turn_over(mesh);
        } else if (is_from_top_by_seams()) {
            if (!kept_turned_) kept_turned_ = std::make_shared<const Image>(turned_over(*image->image));
            return TexturedMesh(std::move(mesh), kept_turned_);
        }
    }
    TexturedMesh out(std::move(mesh), std::move(image->image));
    out.texture_file = std::move(image->file);
    return out;
}

Result<TextureFiles::ReadImage> TextureFiles::read_image_of(const Found& found, const fs::path& mesh) {
    if (found.picture) return picture_of_video(*found.picture, mesh);
    if (!found.bytes && kept_.image && kept_path_ == found.path) return kept_;
    ReadImage out;
    std::vector<std::uint8_t> file;
    if (!found.bytes && options_.keep_files) {
        auto bytes = read_file(found.path);
        if (!bytes) return tl::unexpected(bytes.error());
        file = std::move(*bytes);
    } else if (found.bytes && options_.keep_files) {
        file = *found.bytes;
    }
    auto image = found.bytes ? read_image(*found.bytes) : read_image_file(found.path);
    if (!image && found.bytes) return fail_at(mesh, image.error().kind, found.name + ": " + image.error().message);
    if (!image) return tl::unexpected(with_what_is_taken(image.error(), found.path));
    out.image = std::make_shared<const Image>(std::move(*image));
    if (options_.keep_files) out.file = std::make_shared<const std::vector<std::uint8_t>>(std::move(file));
    kept_turned_.reset();
    kept_ = out;
    kept_path_ = found.bytes ? fs::path() : found.path;
    return out;
}

Result<TextureFiles::ReadImage> TextureFiles::picture_of_video(std::size_t number, const fs::path& mesh) {
    if (kept_picture_ == number) return kept_;
    auto image = video_->picture(number);
    if (!image)
        return fail_at(mesh, image.error().kind,
                       "there is no picture " + std::to_string(number) +
                           " (of 0, 1, ...) for it in the video: " + image.error().message);
    kept_turned_.reset();
    kept_ = {std::make_shared<const Image>(std::move(*image)), nullptr};
    kept_picture_ = number;
    return kept_;
}

Result<TexturedMesh> TextureFiles::read(std::size_t place, TextureUse use, const MeshFileOptions& options) {
    const auto& path = meshes_.paths[place];
    findings_ = {};
    auto mesh = read_mesh(path, options, &findings_);
    if (!mesh) return tl::unexpected(mesh.error());
    return completed(std::move(*mesh), path, place, use);
}

Result<TexturedMesh> TextureFiles::with_image(Mesh mesh, std::size_t place, MeshFindings findings, TextureUse use) {
    findings_ = std::move(findings);
    return completed(std::move(mesh), {}, place, use);
}

}  // namespace htvm
