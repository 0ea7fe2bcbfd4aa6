#include "io/sequence.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "io/mesh_file.h"

namespace htvm {

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

// The number in a name that the pattern could have produced.
std::optional<std::uint64_t> number_in(const NumberedName& pattern, std::string_view name) {
    if (name.size() < pattern.prefix.size() + pattern.digits + pattern.suffix.size()) return std::nullopt;
    if (!name.starts_with(pattern.prefix) || !name.ends_with(pattern.suffix)) return std::nullopt;
    name.remove_prefix(pattern.prefix.size());
    name.remove_suffix(pattern.suffix.size());
    if (name.size() > pattern.digits && name[0] == '0') return std::nullopt;
    std::uint64_t number = 0;
    const char* end = name.data() + name.size();
    const auto [stop, error] = std::from_chars(name.data(), end, number);
    if (error != std::errc() || stop != end) return std::nullopt;
    return number;
}

Result<std::vector<std::string>> files_in(const fs::path& folder) {
    std::error_code error;
    fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, error);
    if (error)
        return fail(ErrorKind::bad_input, "the folder " + folder.string() + " cannot be read: " + error.message());
    std::vector<std::string> names;
    for (; entry != fs::directory_iterator(); entry.increment(error)) {
        std::error_code ignored;
        if (!entry->is_directory(ignored)) names.push_back(entry->path().filename().string());
        if (error) break;
    }
    std::sort(names.begin(), names.end(), natural_less);
    return names;
}

// "nothing is there", "a.ply is there", "a.ply, b.ply, c.txt and 12 others are there".
std::string what_is_there(const fs::path& folder, const std::vector<std::string>& names) {
    const std::string where = folder.empty() ? std::string("this folder") : folder.string();
    if (names.empty()) return where + " holds no files";
    std::string text = where + " holds ";
    const std::size_t shown = std::min<std::size_t>(names.size(), 3);
    for (std::size_t i = 0; i < shown; ++i) text += (i > 0 ? ", " : "") + names[i];
    if (names.size() > shown) text += " and " + std::to_string(names.size() - shown) + " others";
    return text;
}

Result<SequenceFiles> sequence_of(const fs::path& folder, const std::vector<std::string>& names) {
    std::set<std::string> extensions;
    SequenceFiles files;
    for (const std::string& name : names) {
        extensions.insert(fs::path(name).extension().string());
        files.paths.push_back(folder / name);
    }
    if (extensions.size() > 1) {
        std::string list;
        for (const std::string& extension : extensions) list += (list.empty() ? "" : ", ") + extension;
        return fail(ErrorKind::bad_input, "mesh files of several formats were found (" + list + ") in " +
                                              folder.string() + "; say which, such as \"" + (folder / "*").string() +
                                              *extensions.begin() + "\"");
    }
    files.numbers = numbers_in_names(files.paths);
    return files;
}

Result<SequenceFiles> files_of_folder(const fs::path& folder) {
    auto names = files_in(folder);
    if (!names) return tl::unexpected(names.error());
    std::vector<std::string> meshes;
    std::copy_if(names->begin(), names->end(), std::back_inserter(meshes),
                 [](const std::string& name) { return name[0] != '.' && is_mesh_file_name(name); });
    if (meshes.empty()) {
        return fail(ErrorKind::bad_input, "no mesh files (" + std::string(mesh_file_extensions) +
                                              ") were found: " + what_is_there(folder, *names));
    }
    return sequence_of(folder, meshes);
}

Result<SequenceFiles> files_of_pattern(const fs::path& folder, const NumberedName& pattern, std::string_view what) {
    const auto names = files_in(folder);
    if (!names) return tl::unexpected(names.error());
    std::vector<std::pair<std::uint64_t, std::string>> found;
    for (const std::string& name : *names) {
        if (const auto number = number_in(pattern, name)) found.emplace_back(*number, name);
    }
    if (found.empty()) {
        return fail(ErrorKind::bad_input,
                    "no file has a name such as " + std::string(what) + ": " + what_is_there(folder, *names));
    }
    std::sort(found.begin(), found.end());
    SequenceFiles files;
    for (const auto& [number, name] : found) {
        files.numbers.push_back(number);
        files.paths.push_back(folder / name);
    }
    return files;
}

Result<SequenceFiles> files_of_glob(const fs::path& folder, const std::string& glob, std::string_view what) {
    const auto names = files_in(folder);
    if (!names) return tl::unexpected(names.error());
    std::vector<std::string> found;
    for (const std::string& name : *names) {
        if (name[0] == '.' && glob[0] != '.') continue;
        if (glob_matches(glob, name) && is_mesh_file_name(name)) found.push_back(name);
    }
    if (found.empty()) {
        return fail(ErrorKind::bad_input, "no mesh file (" + std::string(mesh_file_extensions) + ") matches " +
                                              std::string(what) + ": " + what_is_there(folder, *names));
    }
    return sequence_of(folder, found);
}

struct NameParts {
    std::string before, after;
    std::uint64_t number = 0;
};

std::optional<NameParts> parts_of(const fs::path& path) {
    constexpr const char* digits = "0123456789";
    const std::string stem = path.stem().string();
    const auto last = stem.find_last_of(digits);
    if (last == std::string::npos) return std::nullopt;
    const auto other = stem.find_last_not_of(digits, last);
    const auto first = other == std::string::npos ? 0 : other + 1;
    NameParts out{stem.substr(0, first), stem.substr(last + 1), 0};
    if (std::from_chars(stem.data() + first, stem.data() + last + 1, out.number).ec != std::errc()) return std::nullopt;
    return out;
}

}  // namespace

Result<SequenceFiles> find_sequence(std::string_view what) {
    if (what.empty()) return fail(ErrorKind::bad_input, "no file or folder was named");
    const fs::path path{what};
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::is_directory(status)) return files_of_folder(path);
    if (fs::exists(status)) return SequenceFiles{{path}, {}};
    const fs::path folder = path.parent_path();
    const std::string name = path.filename().string();
    if (!folder.empty() && !fs::is_directory(folder, error)) {
        return fail(ErrorKind::bad_input, "there is no folder " + folder.string() + " (looking for " +
                                              std::string(what) +
                                              "); %d, * and ? may stand in a path's last part alone");
    }
    const auto pattern = parse_pattern(name);
    if (!pattern) return tl::unexpected(pattern.error());
    if (*pattern) return files_of_pattern(folder, **pattern, what);
    if (name.find_first_of("*?") != name.npos) return files_of_glob(folder, name, what);
    const auto names = files_in(folder);
    if (!names) return tl::unexpected(names.error());
    return fail(ErrorKind::bad_input,
                "there is no file or folder " + std::string(what) + ": " + what_is_there(folder, *names));
}

Result<SequenceFiles> find_sequence(std::span<const std::string> names) {
    if (names.size() == 1) return find_sequence(std::string_view(names[0]));
    if (names.empty()) return fail(ErrorKind::bad_input, "no file or folder was named");
    SequenceFiles files;
    std::error_code error;
    for (const auto& name : names) {
        const fs::path path{name};
        if (!is_mesh_file_name(path) || fs::is_directory(path, error))
            return fail(ErrorKind::bad_input,
                        name +
                            " is not a mesh file (.ply, .obj, .drc); of several names each must be one, a frame "
                            "each; or name one folder, or one pattern in quotes");
        if (!fs::exists(path, error)) return fail(ErrorKind::bad_input, "there is no file " + name);
        if (!files.paths.empty() && path.extension() != files.paths[0].extension())
            return fail(ErrorKind::bad_input, files.paths[0].string() + " and " + name +
                                                  " are mesh files of different formats; name those of one");
        files.paths.push_back(path);
    }
    files.numbers = numbers_in_names(files.paths);
    return files;
}

std::vector<std::uint64_t> numbers_in_names(std::span<const fs::path> paths) {
    std::vector<std::uint64_t> out;
    std::optional<NameParts> first;
    for (const auto& path : paths) {
        const auto parts = parts_of(path);
        if (!parts || (first && (parts->before != first->before || parts->after != first->after))) return {};
        if (!first) first = parts;
        if (!out.empty() && parts->number <= out.back()) return {};
        out.push_back(parts->number);
    }
    return out;
}

std::vector<std::uint64_t> places_in_time(const SequenceFiles& files) {
    const auto& numbers = files.numbers;
    std::vector<std::uint64_t> in_order(files.paths.size());
    std::iota(in_order.begin(), in_order.end(), std::uint64_t{0});
    if (numbers.size() < 2) return in_order;
    std::map<std::uint64_t, std::size_t> steps;
    for (std::size_t k = 1; k < numbers.size(); ++k) ++steps[numbers[k] - numbers[k - 1]];
    const auto usual =
        std::max_element(steps.begin(), steps.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    std::vector<std::uint64_t> out;
    for (const auto number : numbers) {
        if ((number - numbers[0]) % usual->first != 0) return in_order;
        out.push_back((number - numbers[0]) / usual->first);
    }
    return out.back() >= 2 * out.size() ? in_order : out;
}

bool natural_less(std::string_view a, std::string_view b) {
    std::size_t i = 0;
    std::size_t j = 0;
    int zeros = 0;  // leading zeros, decides last
    while (i < a.size() && j < b.size()) {
        if (!is_digit(a[i]) || !is_digit(b[j])) {
            if (a[i] != b[j]) return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
            ++i;
            ++j;
            continue;
        }
        const auto number = [](std::string_view text, std::size_t& at, std::size_t& leading) {
            const std::size_t begin = at;
            while (at < text.size() && text[at] == '0') ++at;
            leading = at - begin;
            const std::size_t first = at;
            while (at < text.size() && is_digit(text[at])) ++at;
            return text.substr(first, at - first);
        };
        std::size_t zeros_a = 0;
        std::size_t zeros_b = 0;
        const std::string_view number_a = number(a, i, zeros_a);
        const std::string_view number_b = number(b, j, zeros_b);
        if (number_a.size() != number_b.size()) return number_a.size() < number_b.size();
        if (number_a != number_b) return number_a < number_b;
        if (zeros == 0 && zeros_a != zeros_b) zeros = zeros_a < zeros_b ? -1 : 1;
    }
    if (i < a.size() || j < b.size()) return j < b.size();
    return zeros < 0;
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
