// Results kept between runs, so that an added coder or quality costs only itself.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "rd_result.h"

namespace htvm::lab {

// Name, size and time of change of each file, and of this program's own: a text that is another once one was changed.
std::string fingerprint(const std::vector<std::filesystem::path>& files);

// A folder with one JSON file a result. The key is a text that says all that the result depends on.
class ResultCache {
public:
    explicit ResultCache(std::filesystem::path folder) : folder_(std::move(folder)) {}
    // Nothing where there is no result of that very key.
    std::optional<RdPoint> find(const std::string& name, const std::string& key) const;
    Result<void> keep(const std::string& name, const std::string& key, const RdPoint& point) const;

private:
    std::filesystem::path file(const std::string& name, const std::string& key) const;
    std::filesystem::path folder_;
};

// Writes a text file as a whole: another run that reads it sees the old one or the new one.
Result<void> write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace htvm::lab
