#include "endurance.h"

#include <sstream>

namespace htvm::lab {

std::optional<double> growth(std::span<const EnduranceRow> rows, const EnduranceMeasure& measure) {
    const std::size_t n = rows.size();
    if (n < 5) return std::nullopt;
    const auto mean = [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += rows[i].*measure.value;
        return sum / static_cast<double>(end - begin);
    };
    const double before = mean(n / 5, 2 * n / 5), last = mean(4 * n / 5, n);
    if (before > 0) return last / before;
    return last > 0 ? std::nullopt : std::optional(1.0);
}

std::size_t resident_bytes(const std::string& statm, std::size_t page_bytes) {
    std::istringstream in(statm);
    std::size_t size = 0, resident = 0;
    return in >> size >> resident ? resident * page_bytes : 0;
}

}  // namespace htvm::lab
