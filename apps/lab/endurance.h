// What changes over a long run, and whether it grows.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "htvm/frame.hpp"

namespace htvm::lab {

// Some seconds of a run.
struct EnduranceRow {
    double from_s = 0, until_s = 0;
    std::array<std::size_t, frame_type_count> frames{};  // by kind
    std::size_t renewals = 0;                            // I-frames that were made of the tracked mesh
    double megabits = 0;                                 // per second
    double m2_mm = 0;                                    // RMS over its frames, to the surface without noise
    double drift_mm = 0, drift_p95_mm = 0;  // along the surface since the triangles were new: mean, and mean of the
                                            // frames' 95th percentiles
    double patches = 0;                     // TP-frames since the I-frame, mean over its frames
    double resident_mb = 0;                 // memory of the process at its end
};

// A column that should not grow.
struct EnduranceMeasure {
    const char* key;
    const char* title;  // with its unit
    double EnduranceRow::*value;
};
inline constexpr std::array endurance_measures = {
    EnduranceMeasure{"megabits_per_second", "bits, Mbit/s", &EnduranceRow::megabits},
    EnduranceMeasure{"m2_mm", "M2 to the truth, mm", &EnduranceRow::m2_mm},
    EnduranceMeasure{"drift_mm", "drift, mean, mm", &EnduranceRow::drift_mm},
    EnduranceMeasure{"drift_p95_mm", "drift, 95 %, mm", &EnduranceRow::drift_p95_mm},
    EnduranceMeasure{"patches", "patches since the I-frame", &EnduranceRow::patches},
    EnduranceMeasure{"resident_mb", "memory, MB", &EnduranceRow::resident_mb},
};

// The mean of the last fifth of the rows relative to that of the second fifth: the first has what happens only once.
// Nothing with fewer than five rows, or if only the second fifth is zero; 1 if both are.
std::optional<double> growth(std::span<const EnduranceRow> rows, const EnduranceMeasure& measure);

inline constexpr double most_growth = 1.15;  // of what is called flat

// Resident memory of this process by the text of /proc/self/statm, in bytes; 0 if it is not known.
std::size_t resident_bytes(const std::string& statm, std::size_t page_bytes);

}  // namespace htvm::lab
