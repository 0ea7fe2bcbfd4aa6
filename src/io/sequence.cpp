#include "io/sequence.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "core/letter_case.h"
#include "io/mesh_file.h"

namespace htvm {

using internal::lower_case;

namespace {

namespace fs = std::filesystem;

// A file name with a number in it.
struct NumberedName {
    std::string prefix;
    std::string suffix;
    std::size_t digits = 1;  // at least this many, padded with zeros
};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Splits "frame_%05d.ply" into its parts; %% stands for a percent sign. Nothing if the name has no %; an error if a %
// is followed by anything except d or 0Nd, or if there are two.
Result<std::optional<NumberedName>> parse_pattern(std::string_view name) {
    NumberedName pattern;
    bool has_number = false;
    for (std::size_t i = 0; i < name.size(); ++i) {
        std::string& part = has_number ? pattern.suffix : pattern.prefix;
        if (name[i] != '%') {
            part += name[i];
            continue;
        }
        if (name.substr(i).starts_with("%%")) {
            part += name[++i];
            continue;
        }
        std::size_t digits = 1;
        std::size_t end = i + 1;
        if (end + 1 < name.size() && name[end] == '0' && is_digit(name[end + 1])) {
            digits = static_cast<std::size_t>(name[end + 1] - '0');
            end += 2;
        }
        if (end >= name.size() || name[end] != 'd' || digits == 0 || has_number) {
            return fail(ErrorKind::bad_input,
                        "\"" + std::string(name) +
                            "\" is not understood: write the place of the frame's number once, as %d "
                            "or %05d, and a percent sign itself as %%");
        }
        has_number = true;
        pattern.digits = digits;
        i = end;
    }
    if (!has_number) return std::optional<NumberedName>();
    return std::optional(std::move(pattern));
}

// The number in a name that the pattern could have produced, whatever its padding.
std::optional<std::int64_t> number_in(const NumberedName& pattern, std::string_view name) {
    if (name.size() <= pattern.prefix.size() + pattern.suffix.size()) return std::nullopt;
    if (!name.starts_with(pattern.prefix) || !name.ends_with(pattern.suffix)) return std::nullopt;
    name.remove_prefix(pattern.prefix.size());
    name.remove_suffix(pattern.suffix.size());
    std::int64_t number = 0;
    const char* end = name.data() + name.size();
    const auto [stop, error] = std::from_chars(name.data(), end, number);
    if (error != std::errc() || stop != end) return std::nullopt;
    return number;
}

// ---- What is in a folder --------------------------------------------------------------------------------------------

bool is_ignored(const std::string& name, const SequenceOptions& options) {
    return std::any_of(options.ignored.begin(), options.ignored.end(),
                       [&](const std::string& glob) { return glob_matches(glob, name); });
}

// The names of the files of a folder, or of the folders in it, without ignored ones, in natural order.
Result<std::vector<std::string>> names_in(const fs::path& folder, bool folders, const SequenceOptions& options) {
    std::error_code error;
    fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, error);
    if (error)
        return fail(ErrorKind::bad_input, "the folder " + folder.string() + " cannot be read: " + error.message());
    std::vector<std::string> names;
    for (; entry != fs::directory_iterator(); entry.increment(error)) {
        std::error_code unknown;
        const auto name = entry->path().filename().string();
        if (entry->is_directory(unknown) == folders && !is_ignored(name, options)) names.push_back(name);
        if (error) break;
    }
    std::sort(names.begin(), names.end(), natural_less);
    return names;
}

// "a.ply, b.ply, c.txt and 12 others".
std::string listed(const std::vector<std::string>& names) {
    std::string text;
    const std::size_t shown = std::min<std::size_t>(names.size(), 3);
    for (std::size_t i = 0; i < shown; ++i) text += (i > 0 ? ", " : "") + names[i];
    const std::size_t others = names.size() - shown;
    if (others > 0) text += " and " + std::to_string(others) + (others > 1 ? " others" : " other");
    return text;
}

std::string what_is_there(const fs::path& folder, const std::vector<std::string>& names,
                          const SequenceOptions& options) {
    const std::string where = folder.empty() ? std::string("this folder") : folder.string();
    const std::string besides = options.ignored.empty() ? "" : " besides what --ignore leaves out";
    return where + " holds " + (names.empty() ? "no files" : listed(names)) + besides;
}

// ---- Meshes that could be frames ------------------------------------------------------------------------------------

// A mesh by what names its frame: its file, or the folder that holds it alone.
struct Entry {
    std::string stem, ending;  // "f_1", ".ply"; "f_1", "/"
    fs::path path;

    std::string name() const { return stem + ending; }
};

Entry entry_of(const fs::path& path) { return {path.stem().string(), path.extension().string(), path}; }

std::vector<std::string> stems_of(const std::vector<Entry>& entries) {
    std::vector<std::string> out;
    for (const auto& entry : entries) out.push_back(entry.stem);
    return out;
}

std::string format_of(const fs::path& path) { return lower_case(path.extension().string()); }

// Leaves out copies of others and what is not finished.
void leave_out_copies(std::vector<Entry>& entries, std::vector<MeshRemark>& remarks) {
    std::set<std::string> names;
    for (const auto& entry : entries) names.insert(entry.name());
    const auto kinds = kinds_of_names(stems_of(entries), "");
    std::vector<bool> is_left_out(entries.size());
    std::vector<std::string> copies, unfinished;
    for (std::size_t k = 0; k < kinds.size(); ++k)
        for (const auto place : kinds[k].places) {
            const auto& entry = entries[place];
            const auto original = original_of_copy(entry.stem);
            // Where most names look like copies, that is how they are numbered.
            const bool is_copy = k > 0 && original && names.count(*original + entry.ending) > 0;
            const bool is_unfinished = is_unfinished_name(entry.stem);
            is_left_out[place] = is_copy || is_unfinished;
            if (is_left_out[place]) (is_unfinished ? unfinished : copies).push_back(entry.name());
        }
    if (copies.size() + unfinished.size() == entries.size()) return;
    std::vector<Entry> kept;
    for (std::size_t place = 0; place < entries.size(); ++place)
        if (!is_left_out[place]) kept.push_back(std::move(entries[place]));
    entries = std::move(kept);
    if (!copies.empty()) remarks.push_back({"copies", "copies of other files are left out: " + listed(copies), true});
    if (!unfinished.empty())
        remarks.push_back({"unfinished", "files that are not finished are left out: " + listed(unfinished), true});
}

Result<void> refuse_several_formats(const std::vector<Entry>& entries, const fs::path& folder) {
    std::map<std::string, std::string> endings;  // by format, as they are written
    for (const auto& entry : entries) endings.try_emplace(format_of(entry.path), entry.path.extension().string());
    if (endings.size() < 2) return {};
    std::string list;
    for (const auto& [format, ending] : endings) list += (list.empty() ? "" : ", ") + ending;
    const auto& one = endings.begin()->second;
    return fail(ErrorKind::bad_input, "mesh files of several formats were found (" + list + ") in " + folder.string() +
                                          "; say which, such as \"" + (folder / "*").string() + one +
                                          "\", or leave some out, as with --ignore \"*" + one + "\"");
}

// Fails if files of several kinds are several captures, or a capture and others.
Result<void> refuse_strangers(const std::vector<Entry>& entries, const std::vector<KindOfNames>& kinds,
                              const fs::path& folder) {
    std::size_t captures = 0, in_captures = 0;
    std::string list;
    const KindOfNames* smallest = nullptr;
    for (const auto& kind : kinds) {
        if (kind.varying_numbers == 0) continue;
        ++captures;
        in_captures += kind.places.size();
        smallest = &kind;
        if (captures <= 4)
            list += (captures > 1 ? ", " : "") + std::to_string(kind.places.size()) + " \"" + kind.pattern + "\"";
    }
    if (captures > 4) list += " and " + std::to_string(captures - 4) + " more";
    const std::string where = folder.empty() ? std::string("this folder") : folder.string();
    if (captures > 1 && 2 * in_captures > entries.size()) {
        auto unwanted = smallest->pattern;
        if (const auto number = unwanted.find("%d"); number != unwanted.npos) unwanted.replace(number, 2, "*");
        return fail(ErrorKind::bad_input, where + " holds several captures, by the names of their files: " + list +
                                              "; name one, such as \"" + (folder / kinds[0].pattern).string() +
                                              "\", or leave others out, as with --ignore \"" + unwanted + "\"");
    }
    constexpr std::size_t fewest = 3;
    const auto& frames = kinds[0];
    if (frames.varying_numbers == 0 || frames.places.size() < fewest || 2 * frames.places.size() <= entries.size())
        return {};
    std::vector<std::string> strangers;
    for (std::size_t k = 1; k < kinds.size(); ++k)
        for (const auto place : kinds[k].places) strangers.push_back(entries[place].name());
    return fail(ErrorKind::bad_input,
                "in " + where + " there " + (strangers.size() > 1 ? "are " : "is ") + listed(strangers) +
                    " beside the " + std::to_string(frames.places.size()) + " frames \"" + frames.pattern +
                    "\": leave " + (strangers.size() > 1 ? "them" : "it") + " out with --ignore \"" + strangers[0] +
                    "\", or name the frames, as \"" + (folder / frames.pattern).string() + "\"");
}

// Names that have no pattern in common, in natural order.
FrameOrder natural_order(const std::vector<Entry>& entries) {
    FrameOrder out;
    for (std::size_t place = 0; place < entries.size(); ++place) out.places.push_back(place);
    std::stable_sort(out.places.begin(), out.places.end(), [&](std::size_t a, std::size_t b) {
        return natural_less(entries[a].path.string(), entries[b].path.string());
    });
    if (entries.size() > 1)
        out.remarks.push_back({"names-differ",
                               "the names are not alike but for a number: the files are in the order of their names, " +
                                   entries[out.places[0]].name() + " first",
                               false});
    return out;
}

Result<FrameOrder> order_of(const std::vector<Entry>& entries, const fs::path& folder) {
    const auto stems = stems_of(entries);
    const auto kinds = kinds_of_names(stems, entries[0].ending);
    if (kinds.size() == 1) return order_of_frames(stems, entries[0].ending);
    const bool has_majority = 10 * kinds[0].places.size() >= 9 * entries.size();
    if (!has_majority)
        if (auto order = order_by_first_number(stems)) return std::move(*order);
    if (auto none = refuse_strangers(entries, kinds, folder); !none) return tl::unexpected(none.error());
    return natural_order(entries);
}

SequenceFiles in_order(const std::vector<Entry>& entries, FrameOrder order, std::vector<MeshRemark> remarks) {
    SequenceFiles files;
    for (const auto place : order.places) files.paths.push_back(entries[place].path);
    files.numbers = std::move(order.numbers);
    files.remarks = std::move(remarks);
    for (auto& more : order.remarks) files.remarks.push_back(std::move(more));
    return files;
}

// What a folder or a glob gives.
Result<SequenceFiles> sequence_of(std::vector<Entry> entries, const fs::path& folder,
                                  std::vector<MeshRemark> remarks = {}) {
    leave_out_copies(entries, remarks);
    if (auto one = refuse_several_formats(entries, folder); !one) return tl::unexpected(one.error());
    auto order = order_of(entries, folder);
    if (!order) return fail(order.error().kind, order.error().message);
    return in_order(entries, std::move(*order), std::move(remarks));
}

// ---- A folder for each frame ----------------------------------------------------------------------------------------

std::vector<std::string> meshes_among(const std::vector<std::string>& names) {
    std::vector<std::string> out;
    std::copy_if(names.begin(), names.end(), std::back_inserter(out),
                 [](const std::string& name) { return name[0] != '.' && is_mesh_file_name(name); });
    return out;
}

struct FolderOfMeshes {
    std::string name;
    std::vector<std::string> meshes;  // at least one
};

// The names that are in all.
std::vector<std::string> names_in_all(const std::vector<FolderOfMeshes>& folders) {
    std::map<std::string, std::size_t> count;
    for (const auto& folder : folders)
        for (const auto& mesh : folder.meshes) ++count[mesh];
    std::vector<std::string> out;
    for (const auto& [name, of] : count)
        if (of == folders.size()) out.push_back(name);
    return out;
}

// What leaves one mesh in each folder, by a pattern for --ignore: all but one of the names that each has, or of the
// kinds of names of which each has one. Nothing if none does, as where each folder is a capture.
std::vector<std::string> patterns_to_ignore(const std::vector<FolderOfMeshes>& folders) {
    constexpr std::size_t most = 4;  // meshes of a frame: more are a capture
    std::vector<std::string> all;
    for (const auto& folder : folders) {
        if (folder.meshes.size() > most) return {};
        all.insert(all.end(), folder.meshes.begin(), folder.meshes.end());
    }
    auto out = names_in_all(folders);
    if (out.size() * folders.size() != all.size()) {
        out.clear();
        for (const auto& kind : kinds_of_names(all, "")) {
            if (kind.places.size() != folders.size()) return {};
            auto pattern = kind.pattern;
            if (const auto number = pattern.find("%d"); number != pattern.npos) pattern.replace(number, 2, "*");
            out.push_back(std::move(pattern));
        }
    }
    if (!out.empty()) out.erase(out.begin());
    return out;
}

Error too_many_in_folders(const fs::path& parent, const std::vector<FolderOfMeshes>& folders) {
    std::vector<std::string> found;
    for (const auto& folder : folders)
        found.push_back(folder.name + " with " + std::to_string(folder.meshes.size()) + " (" + listed(folder.meshes) +
                        ")");
    std::string out = parent.string() + " holds no mesh files but folders of some: " + listed(found);
    const auto ignored = folders.size() > 1 ? patterns_to_ignore(folders) : std::vector<std::string>();
    if (ignored.empty()) {
        out += "; name one of them, such as " + (parent / folders[0].name).string() +
               "; of folders for a frame each, each must hold one mesh";
    } else {
        out += "; of folders for a frame each, each must hold one mesh: leave the others out with";
        for (const auto& pattern : ignored) out += " --ignore \"" + pattern + "\"";
        out += "; or name one of them, such as " + (parent / folders[0].name).string();
    }
    return {ErrorKind::bad_input, std::move(out)};
}

// The frames of a folder without meshes; nothing if its folders have none either.
Result<std::optional<SequenceFiles>> sequence_of_folders(const fs::path& parent, const SequenceOptions& options) {
    const auto names = names_in(parent, true, options);
    if (!names) return tl::unexpected(names.error());
    std::vector<FolderOfMeshes> folders;
    bool one_each = true;
    for (const auto& name : *names) {
        if (name[0] == '.') continue;
        const auto inside = names_in(parent / name, false, options);
        if (!inside) return tl::unexpected(inside.error());
        auto meshes = meshes_among(*inside);
        if (meshes.empty()) continue;
        one_each = one_each && meshes.size() == 1;
        folders.push_back({name, std::move(meshes)});
    }
    if (folders.empty()) return std::optional<SequenceFiles>{};
    std::vector<MeshRemark> remarks;
    const auto in_all = one_each || folders.size() == 1 ? std::vector<std::string>() : names_in_all(folders);
    const auto common = in_all.size() == 1 ? std::optional(in_all[0]) : std::nullopt;
    if (!one_each && !common) return tl::unexpected(too_many_in_folders(parent, folders));
    if (common)
        remarks.push_back(
            {"mesh-of-several", "of the meshes in each folder " + *common + " is taken, which all have", true});
    std::vector<Entry> entries;
    for (const auto& folder : folders)
        entries.push_back({folder.name, "/", parent / folder.name / common.value_or(folder.meshes[0])});
    auto files = sequence_of(std::move(entries), parent, std::move(remarks));
    if (!files) return tl::unexpected(files.error());
    return std::optional(std::move(*files));
}

// A folder two levels below that holds meshes, for messages; the first by name.
std::optional<fs::path> folder_of_meshes_below(const fs::path& top, const SequenceOptions& options) {
    const auto folders = names_in(top, true, options);
    for (const auto& name : folders ? *folders : std::vector<std::string>{}) {
        const auto inner = names_in(top / name, true, options);
        for (const auto& deeper : inner ? *inner : std::vector<std::string>{}) {
            const auto names = names_in(top / name / deeper, false, options);
            if (names && !meshes_among(*names).empty()) return top / name / deeper;
        }
    }
    return std::nullopt;
}

// ---- What was named -------------------------------------------------------------------------------------------------

Result<SequenceFiles> files_of_folder(const fs::path& folder, const SequenceOptions& options) {
    auto names = names_in(folder, false, options);
    if (!names) return tl::unexpected(names.error());
    std::vector<Entry> entries;
    for (const auto& name : meshes_among(*names)) entries.push_back(entry_of(folder / name));
    if (!entries.empty()) return sequence_of(std::move(entries), folder);
    auto in_folders = sequence_of_folders(folder, options);
    if (!in_folders) return tl::unexpected(in_folders.error());
    if (*in_folders) return std::move(**in_folders);
    const auto deeper = folder_of_meshes_below(folder, options);
    return fail(ErrorKind::bad_input, "no mesh files (" + std::string(mesh_file_extensions) +
                                          ") were found: " + what_is_there(folder, *names, options) +
                                          (deeper ? "; but " + deeper->string() + " holds some: name that" : ""));
}

Result<SequenceFiles> files_of_pattern(const fs::path& folder, const NumberedName& pattern, std::string_view what,
                                       const SequenceOptions& options) {
    const auto names = names_in(folder, false, options);
    if (!names) return tl::unexpected(names.error());
    std::vector<std::pair<std::int64_t, std::string>> found;
    for (const std::string& name : *names)
        if (const auto number = number_in(pattern, name)) found.emplace_back(*number, name);
    if (found.empty()) {
        return fail(ErrorKind::bad_input,
                    "no file has a name such as " + std::string(what) + ": " + what_is_there(folder, *names, options));
    }
    std::sort(found.begin(), found.end());
    // A '-' is a sign where numbers without one are there too.
    const bool has_signs = found.back().first >= 0;
    const std::int64_t lowest = has_signs ? std::min<std::int64_t>(found[0].first, 0) : 0;
    if (!has_signs) std::reverse(found.begin(), found.end());
    SequenceFiles files;
    for (std::size_t k = 0; k < found.size(); ++k) {
        const auto& [number, name] = found[k];
        if (k > 0 && number == found[k - 1].first)
            return fail(ErrorKind::bad_input, found[k - 1].second + " and " + name + " in " +
                                                  (folder.empty() ? "this folder" : folder.string()) +
                                                  " have the same number; leave one out with --ignore");
        files.numbers.push_back(has_signs ? static_cast<std::uint64_t>(number) - static_cast<std::uint64_t>(lowest)
                                          : 0 - static_cast<std::uint64_t>(number));
        files.paths.push_back(folder / name);
    }
    if (lowest < 0)
        files.remarks.push_back({"negative-numbers",
                                 "the numbers in the names begin below zero, at " + std::to_string(lowest) +
                                     ": frames are counted from there",
                                 false});
    return files;
}

Result<SequenceFiles> files_of_glob(const fs::path& folder, const std::string& glob, std::string_view what,
                                    const SequenceOptions& options) {
    const auto names = names_in(folder, false, options);
    if (!names) return tl::unexpected(names.error());
    std::vector<Entry> entries;
    for (const std::string& name : *names) {
        if (name[0] == '.' && glob[0] != '.') continue;
        if (glob_matches(glob, name) && is_mesh_file_name(name)) entries.push_back(entry_of(folder / name));
    }
    if (entries.empty()) {
        return fail(ErrorKind::bad_input, "no mesh file (" + std::string(mesh_file_extensions) + ") matches " +
                                              std::string(what) + ": " + what_is_there(folder, *names, options));
    }
    return sequence_of(std::move(entries), folder);
}

// Named files, by what tells them apart: their names, or those of their folders if all files are called alike.
std::vector<Entry> entries_of(const std::vector<fs::path>& paths) {
    const bool alike = std::all_of(paths.begin(), paths.end(),
                                   [&](const fs::path& path) { return path.filename() == paths[0].filename(); });
    std::vector<Entry> out;
    for (const auto& path : paths)
        out.push_back(alike ? Entry{path.parent_path().filename().string(), "/", path} : entry_of(path));
    return out;
}

// The order of files by name, whose order says something too.
SequenceFiles order_of_named(const std::vector<fs::path>& paths) {
    std::vector<MeshRemark> remarks;
    auto entries = entries_of(paths);
    leave_out_copies(entries, remarks);
    const auto stems = stems_of(entries);
    const auto kinds = kinds_of_names(stems, entries[0].ending);
    const auto given = [&] {
        FrameOrder out;
        for (std::size_t place = 0; place < entries.size(); ++place) out.places.push_back(place);
        return out;
    }();
    auto order = natural_order(entries);
    order.remarks.clear();
    bool by_number = false;
    if (kinds.size() == 1) {
        auto numbered = order_of_frames(stems, entries[0].ending);
        by_number = numbered.has_value();
        if (by_number) order = std::move(*numbered);
        if (!numbered) remarks.push_back({"numbers", numbered.error().message, true});
    } else if (kinds[0].varying_numbers > 0 && 2 * kinds[0].places.size() > entries.size() && entries.size() > 3) {
        remarks.push_back({"strangers",
                           entries[kinds[1].places[0]].name() + " is not named as most are (\"" + kinds[0].pattern +
                               "\"), and is a frame all the same",
                           true});
    }
    if (order.places == given.places) return in_order(entries, std::move(order), std::move(remarks));
    std::size_t first = 0;  // of two that are out of order
    std::vector<std::size_t> rank(entries.size());
    for (std::size_t k = 0; k < order.places.size(); ++k) rank[order.places[k]] = k;
    while (rank[first] < rank[first + 1]) ++first;
    const std::string what = entries[first].path.string() + " comes before " + entries[first + 1].path.string();
    std::vector<std::string> texts;
    for (const auto& entry : entries) texts.push_back(entry.path.string());
    if (is_text_order(texts)) {
        remarks.push_back({"shell-order",
                           "the files come in the order of text, as a shell sorts them, in which " + what +
                               ": they are taken by number",
                           false});
        return in_order(entries, std::move(order), std::move(remarks));
    }
    remarks.push_back({"order-given",
                       "the files are taken in the order given, where " + what +
                           "; a folder or a pattern in quotes is taken by number",
                       true});
    return in_order(entries, given, std::move(remarks));
}

void remark_on_ignored(SequenceFiles& files, const std::vector<std::string>& seen, const SequenceOptions& options) {
    for (const auto& glob : options.ignored) {
        const bool any =
            std::any_of(seen.begin(), seen.end(), [&](const auto& name) { return glob_matches(glob, name); });
        if (!any) files.remarks.push_back({"ignored", "--ignore \"" + glob + "\" leaves out nothing", false});
    }
}

// The names in a folder and in its folders that globs could match.
std::vector<std::string> names_seen(const fs::path& folder) {
    std::vector<std::string> out;
    const auto add = [&](const fs::path& where, bool folders) {
        const auto names = names_in(where, folders, {});
        if (names) out.insert(out.end(), names->begin(), names->end());
        return names ? *names : std::vector<std::string>{};
    };
    add(folder, false);
    for (const auto& name : add(folder, true)) add(folder / name, false);
    return out;
}

Result<SequenceFiles> find_in(std::string_view what, const fs::path& folder, const std::string& name,
                              const SequenceOptions& options) {
    std::error_code error;
    if (!folder.empty() && !fs::is_directory(folder, error)) {
        return fail(ErrorKind::bad_input, "there is no folder " + folder.string() + " (looking for " +
                                              std::string(what) +
                                              "); %d, * and ? may stand in a path's last part alone");
    }
    const auto pattern = parse_pattern(name);
    if (!pattern) return tl::unexpected(pattern.error());
    if (*pattern) return files_of_pattern(folder, **pattern, what, options);
    if (name.find_first_of("*?") != name.npos) return files_of_glob(folder, name, what, options);
    const auto names = names_in(folder, false, {});
    if (!names) return tl::unexpected(names.error());
    return fail(ErrorKind::bad_input,
                "there is no file or folder " + std::string(what) + ": " + what_is_there(folder, *names, {}));
}

}  // namespace

Result<SequenceFiles> find_sequence(std::string_view what, const SequenceOptions& options) {
    if (what.empty()) return fail(ErrorKind::bad_input, "no file or folder was named");
    const fs::path path{what};
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    const bool is_folder = fs::is_directory(status);
    if (!is_folder && fs::exists(status)) return SequenceFiles{{path}, {}, {}};
    const auto folder = is_folder ? path : path.parent_path();
    auto files = is_folder ? files_of_folder(path, options) : find_in(what, folder, path.filename().string(), options);
    if (files && !options.ignored.empty()) remark_on_ignored(*files, names_seen(folder), options);
    return files;
}

Result<SequenceFiles> find_sequence(std::span<const std::string> names, const SequenceOptions& options) {
    if (names.size() == 1) return find_sequence(std::string_view(names[0]), options);
    if (names.empty()) return fail(ErrorKind::bad_input, "no file or folder was named");
    std::vector<fs::path> paths;
    std::vector<std::string> seen;
    std::error_code error;
    for (const auto& name : names) {
        const fs::path path{name};
        seen.push_back(path.filename().string());
        if (is_ignored(seen.back(), options)) continue;
        if (!is_mesh_file_name(path) || fs::is_directory(path, error))
            return fail(ErrorKind::bad_input,
                        name + " is not a mesh file (" + std::string(mesh_file_extensions) +
                            "); of several names each must be one, a frame each; or name one folder, or one pattern "
                            "in quotes");
        if (!fs::exists(path, error)) return fail(ErrorKind::bad_input, "there is no file " + name);
        if (!paths.empty() && format_of(path) != format_of(paths[0]))
            return fail(ErrorKind::bad_input,
                        paths[0].string() + " and " + name + " are mesh files of different formats; name those of one");
        paths.push_back(path);
    }
    if (paths.empty()) return fail(ErrorKind::bad_input, "--ignore leaves out all files that were named");
    auto files = order_of_named(paths);
    remark_on_ignored(files, seen, options);
    return files;
}

std::vector<std::uint64_t> numbers_in_names(std::span<const fs::path> paths) {
    std::vector<std::string> stems;
    for (const auto& path : paths) stems.push_back(path.stem().string());
    if (kinds_of_names(stems, "").size() != 1) return {};
    auto order = order_of_frames(stems, "");
    if (!order || !std::is_sorted(order->places.begin(), order->places.end())) return {};
    return std::move(order->numbers);
}

std::vector<std::uint64_t> places_in_time(const SequenceFiles& files) {
    const auto& numbers = files.numbers;
    std::vector<std::uint64_t> out(files.paths.size());
    std::iota(out.begin(), out.end(), std::uint64_t{0});
    const auto step = frame_step(numbers);
    if (!step || numbers.size() < 2) return out;
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = (numbers[k] - numbers[0]) / *step;
    return out;
}

bool glob_matches(std::string_view glob, std::string_view text) {
    std::size_t g = 0;
    std::size_t t = 0;
    std::optional<std::size_t> star;  // the last * seen, and how much of the text it was tried with
    std::size_t tried = 0;
    while (t < text.size()) {
        if (g < glob.size() && glob[g] == '*') {
            star = g++;
            tried = t;
        } else if (g < glob.size() && (glob[g] == '?' || glob[g] == text[t])) {
            ++g;
            ++t;
        } else if (star) {
            g = *star + 1;
            t = ++tried;
        } else {
            return false;
        }
    }
    return glob.find_first_not_of('*', g) == glob.npos;
}

Result<OutputNames> output_names(std::string_view what, std::string_view extension) {
    if (what.empty()) return fail(ErrorKind::bad_input, "no output was named");
    const fs::path path{what};
    std::error_code error;
    OutputNames names;
    const bool folder = what.ends_with('/') || fs::is_directory(path, error);
    const auto pattern = folder ? Result<std::optional<NumberedName>>() : parse_pattern(path.filename().string());
    if (!pattern) return tl::unexpected(pattern.error());
    if (*pattern) {
        names.folder = path.parent_path();
        names.prefix = (*pattern)->prefix;
        names.suffix = (*pattern)->suffix;
        names.digits = static_cast<int>((*pattern)->digits);
    } else if (folder || !path.has_extension()) {
        names.folder = path;
        names.suffix = extension;
    } else {
        names.folder = path.parent_path();
        names.prefix = path.filename().string();
        names.one_file = true;
    }
    return names;
}

Result<OutputNames> mesh_output_names(std::string_view what, std::string_view extension) {
    auto names = output_names(what, extension);
    if (!names) return names;
    const fs::path example = output_path(*names, 0);
    if (is_written_mesh_file_name(example)) return names;
    return fail(ErrorKind::unsupported, "meshes are written as .ply, .obj or .glb, not as " + example.string());
}

std::filesystem::path output_path(const OutputNames& names, std::uint64_t n) {
    if (names.one_file) return names.folder / names.prefix;
    std::string number = std::to_string(n);
    const auto digits = static_cast<std::size_t>(std::max(names.digits, 1));
    if (number.size() < digits) number.insert(0, digits - number.size(), '0');
    return names.folder / (names.prefix + number + names.suffix);
}

}  // namespace htvm
