#include "rd_cache.h"

#include <fmt/core.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/crc32.h"
#include "io/mesh_file.h"

namespace htvm::lab {

using namespace internal;
namespace {

using std::filesystem::path;

std::uint32_t crc_of(const std::string& text) {
    return crc32({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

std::string stamp(const path& file) {
    std::error_code error;
    const auto size = std::filesystem::file_size(file, error);
    if (error) return file.string() + " missing";
    const auto changed = std::filesystem::last_write_time(file, error).time_since_epoch().count();
    return fmt::format("{} {} {}", file.string(), size, changed);
}

}  // namespace

std::string fingerprint(const std::vector<path>& files) {
    std::string all;
    for (const auto& file : files) {
        std::error_code error;
        const auto whole = std::filesystem::absolute(file, error);
        all += stamp(error ? file : whole.lexically_normal()) + "\n";
    }
    std::error_code error;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
    return fmt::format("htvm-lab {} {:08x}; {} files {:08x}", HTVM_VERSION, error ? 0 : crc_of(stamp(program)),
                       files.size(), crc_of(all));
}

path ResultCache::file(const std::string& name, const std::string& key) const {
    return folder_ / fmt::format("{}_{:08x}.json", name, crc_of(key));
}

std::optional<RdPoint> ResultCache::find(const std::string& name, const std::string& key) const {
    const auto bytes = read_file(file(name, key), std::uint64_t{1} << 28);
    if (!bytes) return std::nullopt;
    const auto json = nlohmann::json::parse(bytes->begin(), bytes->end(), nullptr, false);
    if (!json.is_object() || json.value("key", nlohmann::json()) != key || !json.contains("result"))
        return std::nullopt;
    return rd_point_from_json(json["result"]);
}

Result<void> ResultCache::keep(const std::string& name, const std::string& key, const RdPoint& point) const {
    return write_text(file(name, key), nlohmann::json({{"key", key}, {"result", to_json(point)}}).dump());
}

Result<void> write_text(const path& where, const std::string& text) {
    const path temporary = where.string() + fmt::format(".{}", getpid());
    std::ofstream out(temporary, std::ios::binary);
    out << text;
    out.close();
    std::error_code error;
    if (out) std::filesystem::rename(temporary, where, error);
    if (!out || error) return fail(ErrorKind::bad_input, where.string() + " cannot be written");
    return {};
}

}  // namespace htvm::lab
