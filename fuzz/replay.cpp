// Runs inputs through the fuzz targets without a fuzzer, with any compiler: the regression test.
//   fuzz_replay TARGET FILE_OR_FOLDER...   searches folders; skips what does not exist
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "fuzz_targets.h"

namespace {

std::vector<std::filesystem::path> inputs_of(int count, char** names) {
    std::vector<std::filesystem::path> out;
    for (int i = 0; i < count; ++i) {
        const std::filesystem::path path = names[i];
        if (std::filesystem::is_regular_file(path)) out.push_back(path);
        if (!std::filesystem::is_directory(path)) continue;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(path))
            if (entry.is_regular_file()) out.push_back(entry.path());
    }
    std::sort(out.begin(), out.end());
    return out;
}

}  // namespace

int main(int count, char** words) {
    const std::map<std::string, int (*)(const std::uint8_t*, std::size_t)> targets = {HTVM_FUZZ_TARGETS};
    const auto target = targets.find(count > 1 ? words[1] : "");
    if (target == targets.end()) {
        std::cerr << "fuzz_replay TARGET FILE_OR_FOLDER...; targets:";
        for (const auto& [name, run] : targets) std::cerr << ' ' << name;
        std::cerr << '\n';
        return 2;
    }
    target->second(nullptr, 0);
    const auto inputs = inputs_of(count - 2, words + 2);
    for (const auto& path : inputs) {
        std::ifstream file(path, std::ios::binary);
        const std::vector<char> bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
        std::cout << path.filename().string() << std::endl;  // flushed, so that after a crash the last name is the
                                                             // culprit
        target->second(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    }
    std::cout << target->first << ": " << inputs.size() << " inputs\n";
    return 0;
}
