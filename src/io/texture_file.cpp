#include "io/texture_file.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include "core/letter_case.h"
#include "core/srgb.h"
#include "io/image_file.h"
#include "io/recording.h"
#include "io/texture_materials.h"
#include "io/texture_parts.h"

namespace htvm {

using namespace internal;

namespace {

namespace fs = std::filesystem;

constexpr const char* other_ways = "; --texture gives its place, or none to go on without";
constexpr Colour white{255, 255, 255};

tl::unexpected<Error> fail_at(const fs::path& mesh, ErrorKind kind, const std::string& message) {
    return fail(kind, mesh.empty() ? message : mesh.string() + ": " + message);
}

// What names an image, of several: "of its material "skin"", or "of its part 2 of 3".
std::string who_wears(std::size_t image, const TextureReference& texture, const std::vector<bool>& worn) {
    for (std::size_t p = 0; p < worn.size(); ++p) {
        if (!worn[p] || texture.parts[p].image != image) continue;
        const auto& material = texture.parts[p].material;
        return material.empty() ? "of its part " + std::to_string(p + 1) + " of " + std::to_string(worn.size())
                                : "of its material \"" + material.substr(0, 200) + "\"";
    }
    return "of its parts";
}

// The images that parts show, each once.
std::size_t images_of(const TextureReference& texture, const std::vector<bool>& worn) {
    std::set<std::size_t> out;
    for (std::size_t p = 0; p < worn.size(); ++p)
        if (worn[p] && texture.parts[p].image) out.insert(*texture.parts[p].image);
    return out.size();
}

fs::path folder_of(const fs::path& mesh) { return mesh.has_parent_path() ? mesh.parent_path() : fs::path("."); }

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

Colour product(const Colour& a, const Colour& b) {
    Colour out;
    for (std::size_t c = 0; c < 3; ++c) out[c] = level_of(light_of(a[c]) * light_of(b[c]));
    return out;
}

void turn_over(Mesh& mesh) {
    for (auto& texcoord : mesh.texcoords) texcoord[1] = 1 - texcoord[1];
}

}  // namespace

// The pictures that come with a recording.
Result<TextureFiles> TextureFiles::of_recording(TextureFiles files) {
    const auto& recording = *files.meshes_.recording;
    if (!recording.unread_texture.empty())
        return fail(ErrorKind::unsupported,
                    recording.format + ": " + recording.unread_texture + std::string(other_ways));
    files.images_ = recording.images;
    if (!recording.video) return files;
    auto video = TextureVideo::open(*recording.video, files.options_.ffmpeg);
    if (!video) return fail(video.error().kind, recording.format + ": " + video.error().message);
    files.video_ = std::move(*video);
    files.times_ = places_in_time(files.meshes_);
    return files;
}

Result<TextureFiles> TextureFiles::open(const TextureOptions& options, const SequenceFiles& meshes) {
    TextureFiles out;
    out.options_ = options;
    out.meshes_ = meshes;
    const auto& what = options.files;
    if (what.empty() && meshes.recording) return of_recording(std::move(out));
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

std::vector<std::size_t> TextureFiles::places_with_image_beside(std::size_t begin, std::size_t end,
                                                                std::size_t most) const {
    std::vector<std::size_t> out;
    for (std::size_t place = begin; place < std::min(end, meshes_.paths.size()) && out.size() < most; ++place)
        if (image_beside(meshes_.paths[place])) out.push_back(place);
    return out;
}

bool TextureFiles::Kept::is_of(const Found& found) const {
    if (found.picture || picture) return picture == found.picture;
    return found.bytes ? bytes == *found.bytes : !path.empty() && path == found.path;
}

// The parts' images and colours, of an OBJ from its material files.
void TextureFiles::take_parts(const Mesh& mesh, const fs::path& path) {
    const bool is_needed =
        (mesh.colours.empty() || is_one_colour(mesh.colours)) && (path.empty() || !image_beside(path));
    take_materials(findings_, folder_of(path), worn_parts(mesh, findings_.texture), is_needed, named_);
}

// Tells where parts have images of their own, in place of which the user names one.
void TextureFiles::remark_on_one_for_all(const Mesh& mesh, const fs::path& path) {
    const auto worn = worn_parts(mesh, findings_.texture);
    if (std::ranges::count(worn, true) < 2) return;
    auto own = findings_;
    if (!path.empty()) take_materials(own, folder_of(path), worn, false, named_);
    if (const auto images = images_of(own.texture, worn); images > 1)
        remark(&findings_, "one-image-for-all",
               "its parts have " + std::to_string(images) +
                   " images of their own; the one of --texture stands in for all of them",
               true);
}

Result<TextureFiles::Shown> TextureFiles::find(const Mesh& mesh, const fs::path& path, std::size_t place) {
    Shown out;
    if (options_.files == "none") return out;
    if (video_) {
        const auto picture = place < times_.size() ? static_cast<std::size_t>(times_[place]) : place;
        out.images.push_back({video_->path().string(), {}, nullptr, picture});
        return out;
    }
    if (!images_.empty()) {
        const auto& own = images_.size() == 1 ? images_[0] : images_[place];
        out.images.push_back({own.string(), own, nullptr, {}});
        return out;
    }
    auto of_parts = find_of_parts(worn_parts(mesh, findings_.texture), path);
    if (!of_parts || !of_parts->images.empty()) return of_parts;
    if (const auto beside = path.empty() ? std::nullopt : image_beside(path))
        out.images.push_back({beside->string(), *beside, nullptr, {}});
    return out;
}

Result<TextureFiles::Shown> TextureFiles::find_of_parts(const std::vector<bool>& worn, const fs::path& path) {
    const auto& texture = findings_.texture;
    Shown out;
    out.is_of_parts = !texture.parts.empty();
    for (std::size_t i = 0; i < texture.images.size(); ++i) {
        bool is_shown = texture.parts.empty() && i == 0;
        for (std::size_t p = 0; p < worn.size(); ++p) is_shown = is_shown || (worn[p] && texture.parts[p].image == i);
        if (!is_shown) continue;
        const auto& image = texture.images[i];
        if (!image.bytes.empty()) {
            out.images.push_back({image.name, {}, &image.bytes, {}});
            continue;
        }
        const auto file = named_.find(folder_of(path), image.name);
        if (!file) {
            const auto name = "its image \"" + image.name.substr(0, 200) + '"';
            const auto images = images_of(texture, worn);
            if (images < 2) return fail(ErrorKind::bad_input, name + " is not in its folder" + other_ways);
            return fail(ErrorKind::bad_input, name + ", " + who_wears(i, texture, worn) +
                                                  ", is not in its folder; its " + std::to_string(images) +
                                                  " images belong there: --texture gives one "
                                                  "in place of all of them, or none to go on without");
        }
        out.images.push_back({file->string(), *file, nullptr, {}});
    }
    return out;
}

// With the colours of its parts, if these are all there is.
TexturedMesh TextureFiles::without_image(Mesh mesh) {
    if (mesh.colours.empty() && !mesh.positions.empty()) {
        mesh.colours = colours_of_parts(mesh, findings_.texture);
        if (!mesh.colours.empty())
            remark(&findings_, "part-colours", "it has no image; its vertices take the colours of its materials");
    }
    return TexturedMesh(std::move(mesh));
}

Result<TexturedMesh> TextureFiles::completed(Mesh mesh, const fs::path& path, std::size_t place, TextureUse use) {
    image_name_.clear();
    const bool from_top = !path.empty() && counts_texture_from_top(path);
    if ((options_.origin == TextureOrigin::top && !from_top) || (options_.origin == TextureOrigin::bottom && from_top))
        turn_over(mesh);
    if (mesh.positions.empty()) return TexturedMesh(std::move(mesh));
    const bool is_named = !images_.empty() || video_;
    if (is_named)
        remark_on_one_for_all(mesh, path);
    else if (options_.files != "none")
        take_parts(mesh, path);
    if (mesh.texcoords.empty()) {
        if (is_named || use == TextureUse::always)
            return fail_at(path, ErrorKind::bad_input,
                           "the mesh has no texture coordinates, which its image needs; leave --texture out, or write "
                           "the mesh with them");
        return without_image(std::move(mesh));
    }
    const bool is_coloured = !mesh.colours.empty() && !is_one_colour(mesh.colours);
    const bool is_wanted =
        use == TextureUse::always ||
        (use == TextureUse::where_colourless && (is_named || !is_coloured || findings_.texture.colours_multiply));
    const auto shown = find(mesh, path, place);
    if (!shown) {
        if (is_wanted && (use == TextureUse::always || mesh.colours.empty()))
            return fail_at(path, shown.error().kind, shown.error().message);
        // What vertices have is shown, in place of an image that may be meant instead.
        remark(&findings_, "no-image", shown.error().message, is_wanted);
        return TexturedMesh(std::move(mesh));
    }
    if (shown->images.empty()) {
        if (use == TextureUse::always)
            return fail_at(path, ErrorKind::bad_input, "no image was found for it; --texture gives its place");
        if (options_.files != "none")
            remark(&findings_, "no-image", "it has texture coordinates, but no image was found for them");
        return without_image(std::move(mesh));
    }
    image_name_ = shown->images[0].name;
    if (shown->images.size() > 1) image_name_ += " and " + std::to_string(shown->images.size() - 1) + " more";
    if (!is_wanted) return TexturedMesh(std::move(mesh));
    return with_images(std::move(mesh), path, *shown);
}

// What each part that is worn shows, in the order of the parts.
std::vector<AtlasPart> TextureFiles::parts_with(const std::vector<ReadImage>& images, const std::vector<bool>& worn,
                                                const Shown& shown) const {
    const auto& texture = findings_.texture;
    std::vector<AtlasPart> out;
    std::map<std::size_t, std::size_t> read_as;  // of the images that the mesh names, which are shown, in order
    for (std::size_t p = 0; p < worn.size(); ++p)
        if (worn[p] && texture.parts[p].image) read_as.emplace(*texture.parts[p].image, 0);
    std::size_t next = 0;
    for (auto& [named, read] : read_as) read = next++;
    for (std::size_t p = 0; p < worn.size(); ++p) {
        if (!worn[p]) continue;
        const auto& part = texture.parts[p];
        AtlasPart& made = out.emplace_back();
        made.colour = part.colour.value_or(white);
        made.name = part.material;
        if (!part.image) continue;
        const std::size_t read = read_as[*part.image];
        made.image = images[read].image;
        made.name += '\0' + shown.images[read].name;
    }
    return out;
}

Result<TexturedMesh> TextureFiles::with_images(Mesh mesh, const fs::path& path, const Shown& shown) {
    const auto& texture = findings_.texture;
    Colour colour = white;
    if (texture.colours_multiply && is_one_colour(mesh.colours)) colour = mesh.colours.front();
    if (!texture.colours_multiply || is_one_colour(mesh.colours)) mesh.colours.clear();
    const auto worn = shown.is_of_parts ? worn_parts(mesh, texture) : std::vector<bool>();
    bool is_partial = false, has_colours = false;
    std::optional<Colour> first;
    for (std::size_t p = 0; p < worn.size(); ++p) {
        if (!worn[p]) continue;
        is_partial = is_partial || !texture.parts[p].image;
        const Colour own = texture.parts[p].colour.value_or(white);
        has_colours = has_colours || first.value_or(own) != own;
        first = own;
    }
    const bool is_one = shown.images.size() == 1 && !is_partial && !has_colours;
    if (!is_one && options_.keep_files)
        return fail_at(path, ErrorKind::unsupported,
                       (is_partial    ? "a part of the mesh has an image and another has none"
                        : has_colours ? std::string("its parts have one image in different colours")
                                      : "its parts have " + std::to_string(shown.images.size()) + " images") +
                           "; files are kept where one image is for all of it: bake them into one" + other_ways);
    auto images = read_images(shown.images, path);
    if (!images) return tl::unexpected(images.error());
    for (const auto& image : *images)
        for (const auto& said : image.remarks) remark(&findings_, said.about.c_str(), said.text, said.is_loss);
    if (is_one)
        return with_one_image(std::move(mesh), path, std::move(images->front()),
                              product(colour, first.value_or(white)));
    auto parts = parts_with(*images, worn, shown);
    for (auto& part : parts) part.colour = product(part.colour, colour);
    std::vector<std::size_t> place_of(worn.size());  // among those that are worn
    for (std::size_t p = 0, next = 0; p < worn.size(); ++p) {
        place_of[p] = next;
        if (worn[p]) ++next;
    }
    auto made = with_atlas(std::move(mesh), std::move(parts), place_of);
    if (!made) return fail_at(path, made.error().kind, made.error().message + other_ways);
    return made;
}

Result<TexturedMesh> TextureFiles::with_atlas(Mesh mesh, std::vector<AtlasPart> parts,
                                              const std::vector<std::size_t>& place_of) {
    std::vector<std::size_t> part_of(mesh.triangles.size());
    for (std::size_t t = 0; t < part_of.size(); ++t) part_of[t] = place_of[part_of_triangle(findings_.texture, t)];
    auto made = put_into_atlas(mesh, parts, part_of, atlas_);
    if (!made) return tl::unexpected(made.error());
    atlas_ = std::move(made->atlas);
    constexpr double nearly_whole = 0.95;
    if (atlas_.scale < nearly_whole)
        remark(&findings_, "atlas-scale",
               "its images are made smaller, to " + std::to_string(std::lround(100 * atlas_.scale)) +
                   " %, to fit into one of " + std::to_string(largest_image_side) + " x " +
                   std::to_string(largest_image_side) + " pixels");
    if (made->is_folded)
        remark(
            &findings_, "folded-coordinates",
            "some of its triangles repeat their image more often than an image for all parts can hold; their colours "
            "are wrong",
            true);
    return TexturedMesh(std::move(mesh), atlas_.image);
}

TexturedMesh TextureFiles::with_one_image(Mesh mesh, const fs::path& path, ReadImage image, const Colour& colour) {
    if (colour != white && options_.keep_files) {
        remark(&findings_, "kept-colour",
               "its material's colour, which multiplies the image, is left out as that is kept", true);
    } else if (colour != white) {
        if (multiplied_.from != image.image || multiplied_.colour != colour)
            multiplied_ = {image.image, std::make_shared<const Image>(multiplied(*image.image, colour)), colour};
        image.image = multiplied_.to;
    }
    if (options_.origin == TextureOrigin::by_format && says_no_origin(path)) {
        if (!from_top_by_seams_)
            if (const auto difference = difference_at_seams(mesh, *image.image))
                from_top_by_seams_ = difference->from_top < difference->from_bottom;
        // The image, as the coordinates are to stay what the file says wherever they are coded or compared; but a file
        // that is kept cannot be turned.
        if (is_from_top_by_seams() && options_.keep_files) {
            turn_over(mesh);
        } else if (is_from_top_by_seams()) {
            if (turned_.from != image.image)
                turned_ = {image.image, std::make_shared<const Image>(turned_over(*image.image)), white};
            return TexturedMesh(std::move(mesh), turned_.to);
        }
    }
    TexturedMesh out(std::move(mesh), std::move(image.image));
    out.texture_file = std::move(image.file);
    return out;
}

Result<std::vector<TextureFiles::ReadImage>> TextureFiles::read_images(const std::vector<Found>& found,
                                                                       const fs::path& mesh) {
    std::vector<Kept> read;
    std::vector<ReadImage> out;
    for (const auto& one : found) {
        const auto known = std::ranges::find_if(kept_, [&](const Kept& kept) { return kept.is_of(one); });
        if (known != kept_.end()) {
            read.push_back(*known);
        } else {
            auto image = read_image_of(one, mesh);
            if (!image) return tl::unexpected(image.error());
            read.push_back({one.path, one.bytes ? *one.bytes : std::vector<std::uint8_t>(), one.picture, *image});
        }
        out.push_back(read.back().read);
    }
    kept_ = std::move(read);
    return out;
}

Result<TextureFiles::ReadImage> TextureFiles::read_image_of(const Found& found, const fs::path& mesh) {
    if (found.picture) return picture_of_video(*found.picture, mesh);
    ReadImage out;
    std::vector<std::uint8_t> file;
    if (!found.bytes && options_.keep_files) {
        auto bytes = read_file(found.path);
        if (!bytes) return tl::unexpected(bytes.error());
        file = std::move(*bytes);
    } else if (found.bytes && options_.keep_files) {
        file = *found.bytes;
    }
    const int most = options_.keep_files ? largest_image_side : largest_image_side_read;
    std::string damage;
    auto image = found.bytes ? read_image(*found.bytes, most, &damage) : read_image_file(found.path, most, &damage);
    if (!image && found.bytes) return fail_at(mesh, image.error().kind, found.name + ": " + image.error().message);
    if (!image) return tl::unexpected(with_what_is_taken(image.error(), found.path));
    if (!damage.empty()) out.remarks.push_back({"image-damage", "its image (" + found.name + ") " + damage, true});
    const int longest = std::max(image->width, image->height);
    if (longest > largest_image_side) {
        const auto smaller = [&](int side) {
            return std::max(1, static_cast<int>(std::lround(static_cast<double>(side) * largest_image_side / longest)));
        };
        const auto size = [](const Image& of) { return std::to_string(of.width) + " x " + std::to_string(of.height); };
        const auto before = size(*image);
        *image = resized(*image, smaller(image->width), smaller(image->height));
        out.remarks.push_back({"image-size", "its image (" + found.name + ") of " + before +
                                                 " pixels is made smaller, " + size(*image) +
                                                 ", the most that is taken"});
    }
    out.image = std::make_shared<const Image>(std::move(*image));
    if (options_.keep_files) out.file = std::make_shared<const std::vector<std::uint8_t>>(std::move(file));
    return out;
}

Result<TextureFiles::ReadImage> TextureFiles::picture_of_video(std::size_t number, const fs::path& mesh) {
    auto image = video_->picture(number);
    if (!image)
        return fail_at(mesh, image.error().kind,
                       "there is no picture " + std::to_string(number) +
                           " (of 0, 1, ...) for it in the video: " + image.error().message);
    return ReadImage{std::make_shared<const Image>(std::move(*image)), nullptr, {}};
}

Result<TexturedMesh> TextureFiles::read(std::size_t place, TextureUse use, const MeshFileOptions& options) {
    const auto& path = meshes_.paths[place];
    findings_ = {};
    auto mesh = read_mesh_of(meshes_, place, options, &findings_);
    if (!mesh) return tl::unexpected(mesh.error());
    return completed(std::move(*mesh), path, place, use);
}

Result<TexturedMesh> TextureFiles::with_image(Mesh mesh, std::size_t place, MeshFindings findings, TextureUse use) {
    findings_ = std::move(findings);
    return completed(std::move(mesh), {}, place, use);
}

}  // namespace htvm
